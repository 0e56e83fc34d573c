# gnuplot -e "folder='out/report'; images='docs/images'" tradeoffs.gnuplot: the charts of what the engine's choices trade
set terminal svg size 760,440 font 'sans-serif,13' background '#ffffff'
set grid lc rgb '#dddddd'

set output images.'/tradeoff_widening.svg'
set title 'Widening of boxes: leaks against time'
set xlabel 'logarithm of the widening over the reach, base 2 (leftmost: none)'
set ylabel 'leaks of a million rays (0.1: none)'
set y2label 'time over that without widening'
set logscale y
set format y '10^{%T}'
set yrange [0.05:]
set y2range [0.98:1.14]
set y2tics
set xrange [-28.5:-11.5]
set key top center
set arrow from -19, graph 0 to -19, graph 1 nohead dt 3 lc rgb '#888888'
set label 'derived, 2^{-19}' at -18.8, graph 0.6 tc rgb '#666666'
plot folder.'/widening.dat' using 1:($2 > 0 ? $2 : 0.1) with linespoints lw 2 pt 7 lc rgb '#d1495b' title 'leaks', \
     '' using 1:3 axes x1y2 with linespoints lw 2 pt 5 lc rgb '#00798c' title 'time, camera', \
     '' using 1:4 axes x1y2 with linespoints lw 2 pt 9 dt 2 lc rgb '#30638e' title 'time, bounce'
unset arrow
unset label
unset logscale y
unset y2tics
unset y2label

set output images.'/tradeoff_quantisation.svg'
set title 'Bits of planes: memory of a node against visits and time'
set xlabel 'bits of a plane (rightmost: floats)'
set ylabel 'over float boxes; time over 8 bits'
set format y '%g'
set yrange [0.9:*]
set xrange [3.7:9.3]
set xtics ('4, 40 bytes' 4, '5, 46' 5, '6, 52' 6, '7, 58' 7, '8, 64' 8, '32, 208' 9)
set key top right
plot folder.'/quantisation.dat' using 1:3 with linespoints lw 2 pt 7 lc rgb '#888888' title 'area of boxes', \
     '' using 1:4 with linespoints lw 2 pt 7 lc rgb '#d1495b' title 'nodes, camera', \
     '' using 1:5 with linespoints lw 2 pt 7 dt 2 lc rgb '#d1495b' title 'nodes, bounce', \
     '' using 1:8 with linespoints lw 2 pt 5 lc rgb '#00798c' title 'time, camera', \
     '' using 1:9 with linespoints lw 2 pt 5 dt 2 lc rgb '#00798c' title 'time, bounce'

set output images.'/tradeoff_spawn.svg'
set title 'Offset of spawn points: self-hits against surfaces jumped over'
set xlabel 'offset over the derived bound (leftmost: none)'
set ylabel 'share of rays that meet what they leave'
set y2label 'share of gaps of 1 to 1024 ulp jumped over'
set logscale x 2
set logscale y
set format y '10^{%T}'
set yrange [1e-7:1]
set y2range [0:1]
set y2tics 0.2
set xrange [2**-7.3:2**4.3]
set xtics ('0' 2**-7, '1/64' 2**-6, '1/32' 2**-5, '1/16' 2**-4, '1/8' 2**-3, '1/4' 2**-2, '1/2' 0.5, '1' 1, '2' 2, '4' 4, '8' 8, '16' 16)
set key at graph 0.83, graph 0.98
set arrow from 1, graph 0 to 1, graph 1 nohead dt 3 lc rgb '#888888'
x(m) = m > 0 ? m : 2**-7
# What is 0 is not drawn: curves end where no ray of two million meets what it leaves.
y(s) = s > 0 ? s : NaN
plot folder.'/spawn.dat' using (x($1)):(y($2)) with linespoints lw 3 pt 7 lc rgb '#d1495b' title 'all cases', \
     '' using (x($1)):(y($3)) with linespoints lw 1 pt 7 ps 0.5 lc rgb '#edae49' title 'identity', \
     '' using (x($1)):(y($4)) with linespoints lw 1 pt 7 ps 0.5 lc rgb '#66a182' title 'turned', \
     '' using (x($1)):(y($5)) with linespoints lw 1 pt 7 ps 0.5 lc rgb '#8d5fd3' title 'stretched 1:1000', \
     '' using (x($1)):(y($6)) with linespoints lw 1 pt 7 ps 0.5 lc rgb '#888888' title 'moved to 1e7', \
     '' using (x($1)):7 axes x1y2 with linespoints lw 2 pt 5 lc rgb '#00798c' title 'gaps jumped over'
