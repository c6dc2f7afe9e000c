#!/bin/bash
# check_symbols.sh BUILD: what the compiled libraries give away. A kernel object has one global symbol, named after its
# level; no object of the core has writable data; what is global begins with nebel_ or nb_; the core asks for nothing but the C library and maths.
# Not for sanitized builds, which add data and symbols of their own.
set -euo pipefail

build=${1:?usage: check_symbols.sh BUILD}
faults=0
count=0

fault() {
    echo "$*"
    faults=$((faults + 1))
}

# Sections that a program could write to; .data.rel.ro holds constants with addresses in them.
writable_bytes() {
    size -A "$1" | awk '$1 ~ /^\.(data|bss|tdata|tbss)/ && $1 !~ /^\.data\.rel\.ro/ { sum += $2 } END { print sum + 0 }'
}

check_object() {
    local bytes names
    count=$((count + 1))
    bytes=$(writable_bytes "$1")
    [ "$bytes" -eq 0 ] || fault "$1: $bytes bytes of writable data"
    names=$(nm -g --defined-only "$1" | awk 'NF == 3 && $3 !~ /^(nebel|nb)_/ { print $3 }' | xargs)
    [ -z "$names" ] || fault "$1: global names without nebel_ or nb_: $names"
}

# A function shared by two levels would be linked once, with the instructions of either: so every name ends in the level.
# The double references alone may have several entries.
check_kernel() {
    local level names foreign
    level=$(sed -E 's/.*_kernel_([a-z0-9]+)\.dir.*/\1/' <<<"$1")
    names=$(nm -g --defined-only "$1" | awk 'NF == 3 { print $3 }')
    foreign=$(grep -v "_$level\$" <<<"$names" | xargs || true)
    [ -z "$foreign" ] || fault "$1: global names that do not end in _$level: $foreign"
    [[ $level = double || $level = quad ]] || [ "$(wc -l <<<"$names")" -eq 1 ] || fault "$1: more than one global name: $(xargs <<<"$names")"
}

shopt -s nullglob
kernels=("$build"/CMakeFiles/nebel_*_kernel_*.dir/src/*/*.o)
mapfile -t core < <(find "$build/CMakeFiles/nebel_objects.dir" -name '*.o' | sort)
[ ${#core[@]} -gt 0 ] || fault "$build holds no objects of the core: build first"

for object in "${kernels[@]}"; do check_kernel "$object"; done
for object in "${kernels[@]}" "${core[@]}"; do check_object "$object"; done

linked=$(mktemp)
trap 'rm -f "$linked"' EXIT

# Names that neither the core nor the C library has are missing here, so a new dependency cannot slip in.
if [ ${#core[@]} -gt 0 ] && ! gcc -shared -o "$linked" "${kernels[@]}" "${core[@]}" -lm -Wl,--no-undefined; then
    fault "the core does not link with the C library and maths alone"
fi

echo "check_symbols: $count objects, ${#kernels[@]} of them kernels, $faults faults"
[ "$faults" -eq 0 ]
