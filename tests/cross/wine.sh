#!/bin/sh
# wine.sh PROGRAM.exe [ARGUMENT...]: runs a Windows program in the Wine prefix NEBEL_WINE_PREFIX, which scripts/check_wine.sh makes.
# Debian has no wine64 in the path. Nothing is written to the desktop's menus, and nobody is asked about Mono and Gecko.
export WINEPREFIX="${NEBEL_WINE_PREFIX:?}" WINEARCH=win64 WINEDEBUG=-all
export WINEDLLOVERRIDES="mscoree,mshtml=;winemenubuilder.exe=d"
exec /usr/lib/wine/wine64 "$@"
