#!/bin/bash
# demo.sh BUILD: renders every example scene into BUILD/demo and says where the pictures are. The name of a scene of a classic
# technique begins with that of its method.
set -euo pipefail

source=$(cd "$(dirname "$0")/.." && pwd)
build=${1:?usage: demo.sh BUILD}
pictures=$build/demo

shopt -s nullglob
scenes=("$source"/examples/scenes/*.json)
if [ ${#scenes[@]} -eq 0 ]; then
    echo "demo: no scenes in examples/scenes" >&2
    exit 1
fi

mkdir -p "$pictures"
for scene in "${scenes[@]}"; do
    name=$(basename "$scene" .json)
    echo "demo: $name"
    options=()
    case $name in
        # Thousands of shafts, voxels that light goes through, air along with lit fog, nebulae between shells: small, and with one sample, they take a few seconds as the
        # others do.
        foliage | cloud | wisps | sunset | moonrise | flight | clouds | cloud-valley | mist-sea | planet-night) method=exact options=(--size 640x360 --samples 1) ;;
        cells-*) method=cells ;;
        linear-*) method=linear ;;
        vertex-*) method=vertex ;;
        *) method=exact ;;
    esac
    "$build/nebel" render "$scene" -o "$pictures/$name.png" --method "$method" "${options[@]}"
done

echo
echo "The pictures:"
for scene in "${scenes[@]}"; do
    echo "    $pictures/$(basename "$scene" .json).png"
done
