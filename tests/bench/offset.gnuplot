# gnuplot -e "folder='out/report'; images='docs/images'" offset.gnuplot: where secondary rays start, against acne and
# contacts lost. What is 0 is not drawn: curves end where no ray is left.
set terminal svg size 960,700 noenhanced font 'sans-serif,13' background '#ffffff'
set output images.'/tradeoff_offset.svg'
set grid lc rgb '#dddddd'
array colors[7] = ['#222222', '#edae49', '#66a182', '#8d5fd3', '#d1495b', '#00798c', '#30a5d8']
array names[7] = ['plain', 'grazing light', 'scaled 1e-3', 'stretched 1:1000', 'squashed 1:1000', 'at 1e7', 'at 1e7, relative to the eye']
cases = 7
# A key of four columns is wider than a plot.
do for [i=1:cases] {
    set label i '■ '.names[i] at screen 0.09 + 0.23 * ((i - 1) % 4), screen (i > 4 ? 0.03 : 0.065) tc rgb colors[i]
}
some(x) = x > 0 ? x : NaN
place(m) = m > 0 ? m : 2**-7
set logscale xy
set yrange [1e-5:1.5]
set ytics ('1e-5' 1e-5, '1e-4' 1e-4, '0.001' 1e-3, '0.01' 1e-2, '0.1' 0.1, '1' 1)
unset key
set multiplot layout 2,2 margins 0.08,0.985,0.18,0.94 spacing 0.06,0.13

set title 'Meet what they leave (dashed: what is not in their way)'
set ylabel 'share of the rays'
set xrange [2**-7.4:2**6.4]
set xtics ('0' 2**-7, '1/32' 2**-5, '1/8' 2**-3, '1/2' 0.5, '1' 1, '2' 2, '8' 8, '32' 32)
set arrow 1 from 1, graph 0 to 1, graph 1 nohead dt 3 lc rgb '#888888'
plot for [i=1:cases] folder.'/offset_derived.dat' using (place($1)):(some(column(3*i-1))) with linespoints lw 2 pt 7 ps 0.4 lc rgb colors[i], \
     for [i=1:cases] '' using (place($1)):(some(column(3*i))) with lines lw 2 dt 2 lc rgb colors[i]

set title 'The same, by a fixed t_min'
unset ylabel
set xrange [10**-6.2:10**0.2]
set xtics ('1e-6' 1e-6, '1e-5' 1e-5, '1e-4' 1e-4, '0.001' 1e-3, '0.01' 1e-2, '0.1' 0.1, '1' 1)
set arrow 1 from 1e-3, graph 0 to 1e-3, graph 1 nohead dt 3 lc rgb '#888888'
plot for [i=1:cases] folder.'/offset_fixed.dat' using 1:(some(column(3*i-1))) with linespoints lw 2 pt 7 ps 0.4 lc rgb colors[i], \
     for [i=1:cases] '' using 1:(some(column(3*i))) with lines lw 2 dt 2 lc rgb colors[i]

set title 'Pass what is in their way'
set ylabel 'share of the rays that are blocked'
set xlabel 'offset, of the derived one (leftmost: none)'
set xrange [2**-7.4:2**6.4]
set xtics ('0' 2**-7, '1/32' 2**-5, '1/8' 2**-3, '1/2' 0.5, '1' 1, '2' 2, '8' 8, '32' 32)
set arrow 1 from 1, graph 0 to 1, graph 1 nohead dt 3 lc rgb '#888888'
plot for [i=1:cases] folder.'/offset_derived.dat' using (place($1)):(some(column(3*i+1))) with linespoints lw 2 pt 7 ps 0.4 lc rgb colors[i]

set title 'The same, by a fixed t_min'
unset ylabel
set xlabel 't_min, in units of the world'
set xrange [10**-6.2:10**0.2]
set xtics ('1e-6' 1e-6, '1e-5' 1e-5, '1e-4' 1e-4, '0.001' 1e-3, '0.01' 1e-2, '0.1' 0.1, '1' 1)
set arrow 1 from 1e-3, graph 0 to 1e-3, graph 1 nohead dt 3 lc rgb '#888888'
plot for [i=1:cases] folder.'/offset_fixed.dat' using 1:(some(column(3*i+1))) with linespoints lw 2 pt 7 ps 0.4 lc rgb colors[i]
unset multiplot
