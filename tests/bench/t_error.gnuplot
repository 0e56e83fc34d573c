# gnuplot -e "data='out/report/t_error_bunny'; output='docs/images/t_error_bunny.svg'; title='...'" t_error.gnuplot
set terminal svg size 760,440 font 'sans-serif,13' background '#ffffff'
set output output
set title title
set logscale xy
set format x '10^{%T}'
set format y '10^{%T}'
set xlabel 'error of t over |origin| + t |direction|'
set ylabel 'share of hits with a larger error'
set xrange [1e-10:1e-4]
set yrange [1e-5:1]
set grid lc rgb '#dddddd'
set key bottom left
set arrow from 2**-24, graph 0 to 2**-24, graph 1 nohead dt 3 lc rgb '#888888'
set label 'one rounding, 2^{-24}' at 2**-24*1.3, 0.4 left tc rgb '#666666'
plot data.'.dat' with lines lw 2 lc rgb '#d1495b' title "Glint's engine", \
     data.'.driver.dat' with lines lw 2 dt 2 lc rgb '#edae49' title 'driver', \
     data.'.embree.dat' with lines lw 2 lc rgb '#00798c' title 'Embree', \
     data.'.embree_robust.dat' with lines lw 2 dt 2 lc rgb '#30638e' title 'Embree, robust'
