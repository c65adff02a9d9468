#!/bin/sh
# The femur driven by forces as published, on a grid of 0.3: both load cases at three horizons and as local continuum, their mixture, and one
# after the other. What is finished already is not run again: sh reports/remodelling/forces.sh RUNS
set -eu
runs=$1
here=$(dirname "$0")/../../pipelines
outline=$(cd "$here/../sample_data" && pwd)/femur-outline.csv
mkdir -p "$runs"
scene() { # name of the run, scene file without .toml, horizon, sed commands
    name=$1
    file=$2
    horizon=$3
    shift 3
    [ -e "$runs/$name/scene.json" ] && return
    sed -e "s#\"../sample_data/femur-outline.csv\"#\"$outline\"#; s/^spacing = .*/spacing = 0.3/; s/^horizon = .*/horizon = $horizon/" \
        -e 's/^step = .*/step = 0.4/' "$@" "$here/$file.toml" > "$runs/$name.toml"
    echo "$name"
    bonepd-ct scene "$runs/$name.toml" -o "$runs/$name" --threads 1
}
minus() { # line of [output]: the run to compare with
    echo "\$a minus = \"$1\""
}
# The local twin: no horizon, and the density at Gauss points as in the scenes that displacements drive.
local='/^horizon = /d; s/^\[physics.bond-based\]/[physics.continuum]\ndensity_at = "gauss"/'
for case in lc1 lc2; do
    scene $case-continuum femur-$case-shear-forces 0.9 -e "$local"
    for horizon in 0.602 0.903 1.204; do
        scene $case-$horizon femur-$case-shear-forces $horizon -e "$(minus $case-continuum)"
    done
done
scene mixture femur-mixture 0.903
scene in-turn femur-in-turn 0.903 -e "$(minus mixture)"
