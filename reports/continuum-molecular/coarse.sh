#!/bin/sh
# The report's fracture scenes on coarser grids, minutes instead of hours (kinking: turns.sh): sh reports/continuum-molecular/coarse.sh RUNS
set -eu
runs=$1
here=$(dirname "$0")/../../pipelines
mkdir -p "$runs"
scene() { # name, then sed commands that coarsen its file
    name=$1
    shift
    sed "$@" "$here/scene-$name.toml" > "$runs/$name.toml"
    bonepd-ct scene "$runs/$name.toml" -o "$runs/$name"
}
scene notched-plate -e 's/spacing = 0.5/spacing = 1/; s/horizon_ratio = 5/horizon_ratio = 3/; s/step = 0.01/step = 0.02/; s/5\.5\]/6]/'
scene square-inclusion -e 's/spacing = 0.25/spacing = 0.5/; s/horizon_ratio = 5/horizon_ratio = 4/; s/step = 1e-4/step = 1e-3/'
for angle in 0 45 60 90; do
    scene compact-tension-$angle -e 's/spacing = 0.3/spacing = 0.6/; s/0, 10.2, 0.3, 12/0, 10.2, 0.6, 12/' \
        -e 's/0, -12, 0.3, -10.2/0, -12, 0.6, -10.2/; s/25.6, 0.15/25.5, 0.3/; s/9\.288/9.3/; s/step = 0.004/step = 0.01/' \
        -e 's/times = \[0.2\]/times = [0.2, 0.3]/; s/\[-6.3, 0.45\], \[-6.3, -0.45\]/[-6.15, 0.9], [-6.15, -0.9]/'
done
