# gnuplot -e "folder='out/report'; images='docs/images'" lod_pixels.gnuplot: time of a frame against the error allowed
set terminal svg size 760,440 font 'sans-serif,13' background '#ffffff'
set grid lc rgb '#dddddd'
set output images.'/lod_pixels.svg'
set title 'Levels of detail: time of a frame against the error that is allowed'
set xlabel 'pixels allowed (leftmost: the full mesh)'
set ylabel 'milliseconds on the device'
set y2label 'triangles drawn'
set logscale x 2
set logscale y
set logscale y2
set format y '10^{%T}'
set format y2 '10^{%T}'
set ytics nomirror
set y2tics
set xrange [2**-2.3:2**3.3]
# The full mesh has no place on a logarithmic axis: it stands at a quarter.
x(p) = p > 0 ? p : 0.25
set xtics ('0' 0.25, '0.5' 0.5, '1' 1, '2' 2, '4' 4, '8' 8)
set key top right
data = folder.'/lod_pixels.dat'
plot data using (x($1)):2 with linespoints lw 2 pt 7 lc rgb '#d1495b' title 'mesh shaders', \
     '' using (x($1)):3 with linespoints lw 2 pt 5 lc rgb '#00798c' title 'indirect draws', \
     '' using (x($1)):4 with linespoints lw 2 pt 9 lc rgb '#edae49' title 'compute', \
     '' using (x($1)):5 axes x1y2 with linespoints lw 2 dt 3 pt 6 lc rgb '#888888' title 'triangles'
