#!/bin/bash
# demo.sh BUILD [SCENE...]: renders example scenes, all of them if none is named, into BUILD/demo and says where the pictures are. The name
# of a scene of a classic technique begins with the name of its method.
set -euo pipefail

source=$(cd "$(dirname "$0")/.." && pwd)
build=${1:?usage: demo.sh BUILD [SCENE...]}
pictures=$build/demo
shift

scenes=("$@")
if [ ${#scenes[@]} -eq 0 ]; then
    for path in "$source"/examples/scenes/*.json; do scenes+=("$(basename "$path" .json)"); done
fi

mkdir -p "$pictures"
for name in "${scenes[@]}"; do
    echo "demo: $name"
    case $name in
        cells-*) method=cells ;;
        linear-*) method=linear ;;
        vertex-*) method=vertex ;;
        *) method=exact ;;
    esac
    "$build/nebel" render "$source/examples/scenes/$name.json" -o "$pictures/$name.png" --method "$method"
done

echo
echo "The pictures:"
printf "    $pictures/%s.png\n" "${scenes[@]}"
