#!/usr/bin/env bash
# Makes the figures of docs/gallery.md again, with its commands: bash tests/site/gallery.sh HALORAY PYTHON (a minute or two)
set -euo pipefail
haloray=$(realpath "$1") python=$(realpath -s "$2") root=$(realpath "$(dirname "$0")/../..")
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
cd "$scratch"

"$haloray" simulate --style paper --quiet -o plain
"$haloray" simulate --curves --format svg --style paper --quiet -o run
"$haloray" ensemble -n 200 --set haloes.min_point_shear=1e-5 --preset consistent --format svg --style paper --quiet -o ensemble
"$haloray" images "$root/examples/point_source/model.json" --source 0.1,0.05 --format svg --style paper --quiet -o lens
"$haloray" mock -n 9 --format svg --style paper --quiet -o mock
cp "$root"/examples/cutout/* .
"$python" stand_in.py
"$python" prepare.py
"$haloray" fit cutout.fits --model lens.toml --format svg --style paper --quiet -o fit

gallery=$root/docs/figures/gallery
mkdir -p "$gallery"
cp plain/figures/images.png "$root/docs/figures/images.png"
cp run/figures/{mass_function,cylinder,histograms,tidal_maps,flexion_maps}.svg ensemble/figures/{distributions,convergence}.svg \
    lens/curves.svg mock/mosaic.svg fit/{reconstruction,corner_shear}.svg "$gallery"
du -sh "$gallery"
