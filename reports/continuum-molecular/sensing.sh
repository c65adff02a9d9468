#!/bin/sh
# Damage sensing at the four angles of the compact tension specimen, with and without the strain of the bonds. What is finished already is not
# run again: sh reports/continuum-molecular/sensing.sh RUNS
set -eu
runs=$1
here=$(dirname "$0")/../../pipelines
mkdir -p "$runs"
for slope in 0 -24 -2.4; do
    for angle in 0 45 60 90; do
        name=damage-sensing-$angle-slope$slope
        [ -e "$runs/$name/scene.json" ] && continue
        sed -e "s/^angle_deg = 0/angle_deg = $angle/; s/^piezoresistance = .*/piezoresistance = $slope/" "$here/scene-damage-sensing.toml" > "$runs/$name.toml"
        echo "$name"
        bonepd-ct scene "$runs/$name.toml" -o "$runs/$name" --threads 1
    done
done
