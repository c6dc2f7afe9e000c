#!/bin/bash
# install_packages.sh [SECTION...]: installs what is missing of the named sections of packages.txt (default: build).
# Does nothing, and touches no network, when nothing is missing.
set -euo pipefail

here=$(cd "$(dirname "$0")" && pwd)

packages_of() {
    awk -v wanted=" $* " '
        { sub(/#.*/, ""); gsub(/[ \t]+/, "") }
        /^\[.*\]$/ { listed = index(wanted, " " substr($0, 2, length($0) - 2) " ") > 0; next }
        listed && $0 != "" { print }' "$here/packages.txt"
}

missing_of() {
    local package
    for package in "$@"; do
        dpkg-query -W -f '${db:Status-Status}\n' "$package" 2>/dev/null | grep -qx installed || echo "$package"
    done
}

mapfile -t wanted < <(packages_of "${@:-build}")

if ! command -v dpkg-query >/dev/null || ! command -v apt-get >/dev/null; then
    {
        echo "nebel: this system has no apt. Should the build stop, install what these Debian packages contain:"
        printf '    %s\n' "${wanted[@]}"
    } >&2
    exit 0
fi

mapfile -t missing < <(missing_of "${wanted[@]}")
if [ ${#missing[@]} -eq 0 ]; then exit 0; fi

as_root=()
if [ "$(id -u)" -ne 0 ]; then
    if ! command -v sudo >/dev/null; then
        echo "nebel: missing packages, and neither root nor sudo to install them. As root:" >&2
        echo "    apt-get install --no-install-recommends ${missing[*]}" >&2
        exit 1
    fi
    as_root=(sudo)
fi

echo "nebel: installing ${missing[*]}; this may take minutes"
log=$(mktemp)
trap 'rm -f "$log"' EXIT
apt=("${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get -o DPkg::Lock::Timeout=900 -q -y)
if ! { "${apt[@]}" update && "${apt[@]}" install --no-install-recommends "${missing[@]}"; } >"$log" 2>&1; then
    cat "$log" >&2
    echo "nebel: apt-get could not install ${missing[*]}; its message is above" >&2
    exit 1
fi
