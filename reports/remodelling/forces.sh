#!/bin/sh
# The femur driven by forces as published: both load cases at several horizons and as local continuum, their mixture, and variants of the
# law on a coarser grid. What is finished already is not run again: sh reports/remodelling/forces.sh RUNS
set -eu
runs=$1
here=$(dirname "$0")/../../pipelines
outline=$(cd "$here/../sample_data" && pwd)/femur-outline.csv
mkdir -p "$runs"
scene() { # name of the run, scene file without .toml, sed commands
    name=$1
    file=$2
    shift 2
    [ -e "$runs/$name/scene.json" ] && return
    sed -e "s#\"../sample_data/femur-outline.csv\"#\"$outline\"#" "$@" "$here/$file.toml" > "$runs/$name.toml"
    echo "$name"
    bonepd-ct scene "$runs/$name.toml" -o "$runs/$name" --threads 1
}
# The local twin: no horizon, and the density at Gauss points as in the scenes that displacements drive.
local='/^horizon = /d; s/^\[physics.bond-based\]/[physics.continuum]\ndensity_at = "gauss"/'
for case in lc1 lc2; do
    scene forces-$case-continuum femur-$case-shear-forces -e "$local"
    for horizon in 0.602 0.902 1.202; do
        scene forces-$case-$horizon femur-$case-shear-forces -e "s/^horizon = .*/horizon = $horizon/" -e "\$a minus = \"forces-$case-continuum\""
    done
done
scene forces-mixture femur-mixture
scene forces-in-turn femur-in-turn -e '$a minus = "forces-mixture"'
scene forces-cycles femur-cycles -e '$a minus = "forces-lc1-0.602"'
# Variants on a grid of 0.4.
coarse='s/^spacing = .*/spacing = 0.4/; s/^horizon = .*/horizon = 1.204/; s/0\.6\] }/0.8] }/; s/^step = .*/step = 0.4/'
scene coarse-0.2 femur-lc1-shear-forces -e "$coarse"
scene coarse-third femur-lc1-shear-forces -e "$coarse" -e '/^poisson/d' -e '$a minus = "coarse-0.2"'
scene coarse-local femur-lc1-shear-forces -e "$coarse" -e "$local" -e '$a minus = "coarse-0.2"'
scene coarse-neo-hooke femur-lc1-shear-forces -e "$coarse" -e "$local" -e 's/^young/energy = "neo-hooke"\nyoung/' -e '$a minus = "coarse-local"'
