# gnuplot -e "folder='out/report'; images='docs/images'" splats.gnuplot: what the splat renderer's numbers trade
set terminal svg size 960,440 font 'sans-serif,13' background '#ffffff'
set grid lc rgb '#dddddd'
# The real scene is there if somebody named one.
scenes = system("cd '".folder."' && ls -r splat_cut_*.dat | sed 's/splat_cut_//; s/.dat//'")
data(kind, i) = folder.'/splat_'.kind.'_'.word(scenes, i).'.dat'
array colors[5] = ['#d1495b', '#00798c', '#edae49', '#66a182', '#8d5fd3']
fraction(x) = x > 2e-4 ? sprintf('1/%.0f', 1 / x) : x > 0.9e-4 ? '1e-4' : x > 0.9e-5 ? '1e-5' : '1e-6'
set format y '10^{%T}'

set output images.'/splat_cut_offs.svg'
set multiplot layout 1,2
set logscale y
set xlabel 'time of a picture, over the default'
set key top right
set offsets graph 0.12, graph 0.12, 0, 0
set title 'Transmittance stop'
set ylabel 'rmse against no stop'
plot for [i=1:words(scenes)] data('stop', i) using 2:3 with linespoints lw 2 pt 7 ps 0.6 lc rgb colors[i] title word(scenes, i), \
     data('stop', 1) using 2:3:(fraction($1)) with labels left offset 0.7,0.3 font ',10' tc rgb colors[1] notitle, \
     data('stop', words(scenes)) using 2:3:(fraction($1)) with labels right offset -0.7,-0.3 font ',10' tc rgb colors[words(scenes)] notitle
set title 'Alpha cut'
set ylabel 'rmse against no cut'
plot for [i=1:words(scenes)] data('cut', i) using 2:3 with linespoints lw 2 pt 7 ps 0.6 lc rgb colors[i] title word(scenes, i), \
     data('cut', 1) using 2:3:(fraction($1)) with labels left offset 0.7,0.3 font ',10' tc rgb colors[1] notitle, \
     data('cut', words(scenes)) using 2:3:(fraction($1)) with labels right offset -0.7,-0.3 font ',10' tc rgb colors[words(scenes)] notitle
unset multiplot
set offsets

array names[5] = ['float32', 'default', 'float16 covariance', '.spz', '.splat']
array points[5] = [7, 5, 9, 11, 13]
set output images.'/splat_storage.svg'
set multiplot layout 1,words(scenes)
set logscale x
set xtics (16, 32, 64, 128, 256)
set xrange [5:300]
set yrange [5e-6:0.2]
set xlabel 'bytes of a splat'
do for [s=1:words(scenes)] {
    set title 'Storage, '.word(scenes, s)
    set ylabel 'rmse against float32'
    set key bottom left Left reverse samplen 1 font ',11'
    plot for [i=1:5] data('storage', s) index i-1 using 2:3 with linespoints lw 2 pt points[i] ps 0.7 lc rgb colors[i] title names[i], \
         for [i=1:4] data('storage', s) index i-1 using 2:3:(sprintf('%d', $1)) with labels left offset 0.6,0.5 font ',10' tc rgb colors[i] notitle
}
unset multiplot

set output images.'/splat_degrees.svg'
set multiplot layout 1,words(scenes)
unset logscale x
set xtics 0.1
set xrange [0.7:1.15]
set yrange [1e-6:0.2]
set xlabel 'time of a picture, over float32 with all'
do for [s=1:words(scenes)] {
    set title 'Harmonics, '.word(scenes, s)
    set ylabel 'rmse against float64 with all'
    plot for [i=1:2] data('storage', s) index i-1 using 5:4 with linespoints lw 2 pt points[i] ps 0.7 lc rgb colors[i] title names[i], \
         for [i=1:2] data('storage', s) index i-1 using 5:4:(sprintf('%d', $1)) with labels left offset 0.6,0.5 font ',10' tc rgb colors[i] notitle
}
unset multiplot
unset logscale
unset xrange
unset yrange

set output images.'/splat_tiles.svg'
set multiplot layout 1,words(scenes)
set format y '%g'
set xlabel 'width of a tile, pixels'
set ylabel 'time of a picture, over the default'
set xtics (8, 16, 32)
set xrange [6:40]
set yrange [0.85:1.3]
set logscale x
set key top right Right noreverse samplen 4 font ',13'
do for [s=1:words(scenes)] {
    set title 'Tiles, '.word(scenes, s)
    plot for [h=0:2] data('tiles', s) every :::h::h using 1:3 with linespoints lw 2 pt 7 ps 0.7 lc rgb colors[h+1] title sprintf('height %d', 8 * 2**h)
}
unset multiplot
unset xrange
unset yrange
set xtics autofreq

set terminal svg size 760,440 font 'sans-serif,13' background '#ffffff'
set output images.'/splat_needles.svg'
set title 'Needles of 0.1 pixel: errors of weights'
set logscale xy
set format y '10^{%T}'
set format x '%g'
set xlabel 'length, pixels (standard deviation)'
set ylabel 'error of a weight'
set yrange [1e-9:2]
set key bottom right
needles = folder.'/splat_needles.dat'
plot needles using 1:3 with linespoints lw 2 pt 7 ps 0.6 lc rgb '#d1495b' title 'inverse covariance, largest', \
     needles using 1:2 with linespoints lw 2 dt 2 pt 7 ps 0.4 lc rgb '#d1495b' title '99 %', \
     needles using 1:5 with linespoints lw 2 pt 5 ps 0.6 lc rgb '#00798c' title 'factors, largest', \
     needles using 1:4 with linespoints lw 2 dt 2 pt 5 ps 0.4 lc rgb '#00798c' title '99 %', \
     needles using 1:6 with linespoints lw 2 pt 9 ps 0.6 lc rgb '#222222' title 'drawn in 512 x 512 pixels, largest'
