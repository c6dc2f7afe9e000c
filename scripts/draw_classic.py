#!/usr/bin/env python3
"""Draws the pictures of docs/classic.md and of its sections elsewhere, each beside the exact one and the difference.

    scripts/draw_classic.py BUILD [FOLDER]

BUILD holds the program and, for the curves, libnebel.so (-DBUILD_SHARED_LIBS=ON); where BUILD/windows is what scripts/check_wine.sh left,
Wine draws the Direct3D 9 program. Without FOLDER the pictures of docs/pictures are replaced. Prints what the page says of differences.
"""

import os
import pathlib
import struct
import subprocess
import sys
import tempfile
import zlib

ROOT = pathlib.Path(__file__).resolve().parent.parent
SCENES = ROOT / "examples/scenes"
SMALL, LARGE = "480x270", "640x360"

FINE = ("--tessellate", "0.00392")
FINER = (*FINE, "--tessellate-triangles", "1000000")

# Picture: the scene, its size, what else the program is told.
DRAWN = {
    "classic-exact": ("morning-mist", LARGE),
    "classic-vertex": ("morning-mist", LARGE, "--method", "vertex"),
    "classic-additive": ("morning-mist", LARGE, "--method", "additive"),
    "linear-exact-0": ("linear-plane", SMALL),
    "linear-exact-30": ("linear-plane", SMALL, "--frame", "30"),
    "linear-plane-0": ("linear-plane", SMALL, "--method", "linear"),
    "linear-plane-30": ("linear-plane", SMALL, "--method", "linear", "--frame", "30"),
    "linear-radial-0": ("linear-radial", SMALL, "--method", "linear"),
    "linear-radial-30": ("linear-radial", SMALL, "--method", "linear", "--frame", "30"),
    "exp-radial": ("linear-radial", SMALL, "--method", "exp"),
    "exp2-radial": ("linear-radial", SMALL, "--method", "exp2"),
    "curve-exact": ("curve-table", SMALL),
    "curve-table": ("curve-table", SMALL, "--method", "fog-coord"),
    "device-exact": ("device-range", SMALL),
    "device-depth": ("device-depth", SMALL, "--method", "d3d9"),
    "device-range": ("device-range", SMALL, "--method", "d3d9"),
    "coarse-exact": ("vertex-coarse", SMALL),
    "coarse-vertex": ("vertex-coarse", SMALL, "--method", "vertex"),
    "coarse-tessellated": ("vertex-coarse", SMALL, "--method", "vertex", *FINE),
    "fog-sphere-exact": ("vertex-sphere", SMALL),
    "fog-sphere-vertex": ("vertex-sphere", SMALL, "--method", "vertex"),
    "fog-sphere-tessellated": ("vertex-sphere", SMALL, "--method", "vertex", *FINER),
    "ground-fog-exact": ("ground-fog", SMALL),
    "ground-fog-vertex": ("ground-fog", SMALL, "--method", "vertex"),
    "cells-exact": ("cells-grouped", LARGE),
    "cells-grouped": ("cells-grouped", LARGE, "--method", "cells"),
    "cells-seam": ("cells-seam", LARGE, "--method", "cells"),
    "cells-printed": ("cells-printed", LARGE, "--method", "cells"),
    "cells-portals-exact": ("cells-portals", LARGE),
    "cells-portals": ("cells-portals", LARGE, "--method", "cells"),
    "cells-walls-exact": ("cells-walls", LARGE),
    "cells-walls": ("cells-walls", LARGE, "--method", "cells-pixel"),
}

# Difference: the picture, that from which it differs, how many times as bright.
DIFFERENCES = {
    "classic-vertex-difference": ("classic-vertex", "classic-exact", 4),
    "classic-additive-difference": ("classic-additive", "classic-exact", 4),
    "classic-passes-difference": ("classic-additive", "classic-vertex", 8),
    **{f"linear-{kind}-{frame}-difference": (f"linear-{kind}-{frame}", f"linear-exact-{frame}", 4)
       for kind in ("plane", "radial") for frame in (0, 30)},
    "exp-radial-difference": ("exp-radial", "linear-exact-0", 4),
    "exp2-radial-difference": ("exp2-radial", "linear-exact-0", 4),
    "curve-table-difference": ("curve-table", "curve-exact", 4),
    "device-depth-difference": ("device-depth", "device-exact", 4),
    "device-range-difference": ("device-range", "device-exact", 4),
    **{f"{name}-difference": (name, f"{name.rsplit('-', 1)[0]}-exact", 4)
       for name in ("coarse-vertex", "fog-sphere-vertex", "fog-sphere-tessellated", "ground-fog-vertex")},
    "coarse-tessellated-difference": ("coarse-tessellated", "coarse-exact", 128),
    **{f"cells-{name}-difference": (f"cells-{name}", "cells-exact", 4) for name in ("grouped", "seam", "printed")},
    "cells-portals-difference": ("cells-portals", "cells-portals-exact", 16),
    "cells-walls-difference": ("cells-walls", "cells-walls-exact", 4),
}

CURVES, WINDOWS = "curves.svg", "d3d9-specular.png"

# Of the README and of the examples.
ELSEWHERE = ["forty-volumes.png", "embedding.png", "embedding-vertex-colors.png"]


def names():
    """Every picture that this program makes."""
    return [*(f"{name}.png" for name in (*DRAWN, *DIFFERENCES)), CURVES, WINDOWS]


def run(*words, **more):
    done = subprocess.run([str(word) for word in words], stdout=subprocess.PIPE, text=True, **more)
    if done.returncode != 0:
        sys.exit(f"draw_classic: {words[0]}: status {done.returncode}")
    return done.stdout


def draw(nebel, folder):
    for name, (scene, size, *options) in DRAWN.items():
        print(name, flush=True)
        run(nebel, "render", SCENES / f"{scene}.json", "-o", folder / f"{name}.png", "--size", size, "--samples", 8, *options)
    for name, (picture, exact, times) in DIFFERENCES.items():
        told = run(nebel, "compare", folder / f"{exact}.png", folder / f"{picture}.png", "-o", folder / f"{name}.png", "--amplify", times)
        print(f"{name}:", ", ".join(line for line in told.splitlines() if line.startswith(("RMSE", "largest"))))


def write_png(path, ppm):
    """Of what the Direct3D program writes."""
    kind, width, height, _ = ppm.split(maxsplit=4)[:4]
    row, rows = 3 * int(width), ppm[-3 * int(width) * int(height):]
    assert kind == b"P6"
    lines = b"".join(b"\0" + rows[at:at + row] for at in range(0, len(rows), row))
    with path.open("wb") as file:
        file.write(b"\x89PNG\r\n\x1a\n")
        for name, data in ((b"IHDR", struct.pack(">IIBBBBB", int(width), int(height), 8, 2, 0, 0, 0)),
                           (b"IDAT", zlib.compress(lines, 9)), (b"IEND", b"")):
            file.write(struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data)))


def draw_in_wine(build, program, picture):
    with tempfile.TemporaryDirectory() as folder:
        path = pathlib.Path(folder) / "frame.ppm"
        run("xvfb-run", "-a", "-s", "-screen 0 800x600x24", ROOT / "tests/cross/wine.sh", program, path,
            env={**os.environ, "NEBEL_WINE_PREFIX": str((build / "wine-prefix").resolve())})
        write_png(picture, path.read_bytes())


def draw_others(build, folder):
    library, program = build / "libnebel.so", build / "windows/examples/d3d9_specular.exe"
    if library.exists():
        (folder / CURVES).write_text(run(sys.executable, ROOT / "scripts/plot_curves.py", library))
    else:
        print(f"draw_classic: {CURVES} stays as it is for want of {library}")
    if program.exists():
        draw_in_wine(build, program, folder / WINDOWS)
    else:
        print(f"draw_classic: {WINDOWS} stays as it is for want of {program}")


def main():
    if len(sys.argv) not in (2, 3):
        sys.exit(__doc__)
    build = pathlib.Path(sys.argv[1])
    folder = pathlib.Path(sys.argv[2]) if len(sys.argv) == 3 else ROOT / "docs/pictures"
    folder.mkdir(parents=True, exist_ok=True)
    draw(build / "nebel", folder)
    draw_others(build, folder)


if __name__ == "__main__":
    main()
