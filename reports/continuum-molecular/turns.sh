#!/bin/sh
# Crack kinking with crack, material and field turned together against the grid, a/40, m = 5: nothing changes but the grid.
# The turns are spread evenly over the square grid's period; at 45 degrees sharp, points would lie on the crack. What is
# finished already is not run again: sh reports/continuum-molecular/turns.sh RUNS
set -eu
runs=$1
here=$(dirname "$0")/../../pipelines
mkdir -p "$runs"
for material in anisotropic silicon; do
    for turn in 0 11.25 22.5 33.75 45.001 56.25 67.5 78.75; do
        name=crack-kinking-$material-turn-$turn
        [ -e "$runs/$name/scene.json" ] && continue
        start=$(awk "BEGIN { t = $turn * atan2(0, -1) / 180; printf \"%.15g, %.15g\", -2 * cos(t), -2 * sin(t) }")
        sed -e 's/spacing = 0.0166*/spacing = 0.025/; s/0\.908/0.8625/; s/tip = \[0, 0\]/&\nwindow_points = 500/' \
            -e "s/cracks = .*/cracks = [[$start, 0, 0]]/; s/crack-tip = \[1, 0\] }/&, angle_deg = $turn/" \
            -e "s/^moduli = .*/&\nangle_deg = $turn/" "$here/scene-crack-kinking-$material.toml" > "$runs/$name.toml"
        bonepd-ct scene "$runs/$name.toml" -o "$runs/$name"
    done
done
