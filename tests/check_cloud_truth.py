#!/usr/bin/env python3
"""Compares the light of broken clouds with the reference path tracer: the mean over pictures from above, from below and
aslant.

check_cloud_truth.py [SET] [SAMPLES] [SEED]: paths of SAMPLES for each of 24 x 24 pixels and each color (2), of a set of layers:
few; many, whose coverage, extinction and sizes differ; sheets; earth, with air, sky and ground. Without these pictures show nothing
but the light of clouds. Prints for each view its light by that of the reference, and the reference's standard error. Fails if
the mean of a view and a sun over all layers is farther off than a tenth and three standard errors.
"""

import json
import math
import os
import pathlib
import subprocess
import sys
import tempfile

import numpy as np

from picture_files import read_exr

NEBEL = os.environ["NEBEL"]
SIDE, FINE = 24, 96  # of pictures by paths and by the model
SUNS = (60, 30, 10)
VIEWS = ("above", "below", "aslant")
MOST_OFF = 0.1

CUMULUS = {"type": "cumulus", "coverage": 0.5}
SETS = {
    "few": [{**CUMULUS, "seed": 11}, {**CUMULUS, "coverage": 0.7, "seed": 12}],
    "many": [{**CUMULUS, "coverage": 0.3, "seed": 21}, {**CUMULUS, "seed": 22}, {**CUMULUS, "coverage": 0.8, "seed": 23},
             {**CUMULUS, "extinction": 0.02, "seed": 24}, {**CUMULUS, "extinction": 0.1, "seed": 25},
             {**CUMULUS, "cell_size": 3500, "seed": 26}, {**CUMULUS, "cell_size": 1300, "seed": 27}],
    "sheets": [{"type": "stratus", "coverage": c, "seed": 31} for c in (0.5, 0.85)],
    "earth": [{**CUMULUS, "seed": 41}, {**CUMULUS, "coverage": 0.8, "seed": 42}],
}
VACUUM = {"components": [{"type": "exponential", "scattering": 1e-12, "scale_height": 8000, "phase": {"type": "henyey_greenstein", "g": 0}}],
          "ground_albedo": 0}


def scene(layer, sun, view, is_earth):
    height = 2 if view == "below" else 8000
    ahead = {"below": (0, 1, 0), "aslant": (0, -0.5, 0.87)}.get(view, (0, -1, 0))
    turn = math.radians(sun)
    camera = {"position": [0, height, 0], "look_at": [ahead[0], height + ahead[1], ahead[2]], "up": [1, 0, 0],
              "vertical_fov": 40 if view == "aslant" else 100}
    planet = {"preset": "earth"} if is_earth else VACUUM
    return {"nebel": 1, "fog": [], "camera": camera,
            "sun": {"direction": [0.6 * math.cos(turn), math.sin(turn), 0.8 * math.cos(turn)], "irradiance": 1},
            "planet": {"model": "physical", **planet, "clouds": [layer]}}


def render(of, folder, *options):
    path, picture = folder / "scene.json", folder / "picture.exr"
    path.write_text(json.dumps(of))
    subprocess.run([NEBEL, "render", path, "-o", picture, "--quiet", "--aov", *map(str, options)], check=True)
    return read_exr(picture.read_bytes())


def light_of(planes):
    return sum(float(planes[c].astype(float).mean()) for c in "RGB") / 3


def error_of(planes):
    """Of the mean over the picture: each color has paths of its own. It takes two paths a pixel."""
    squares = sum(float((planes["standard_error." + c].astype(float) ** 2).sum()) for c in "RGB")
    return math.sqrt(squares) / planes["R"].size / 3


def name_of(layer):
    return " ".join(str(v) for v in layer.values())


def main():
    chosen = sys.argv[1] if len(sys.argv) > 1 else "few"
    samples, seed = (int(sys.argv[i]) if len(sys.argv) > i else default for i, default in ((2, 2), (3, 1)))
    sums, failed = {}, 0
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        for layer in SETS[chosen]:
            for sun in SUNS:
                row = []
                for view in VIEWS:
                    of = scene(layer, sun, view, chosen == "earth")
                    paths = render(of, folder, "--method", "path", "--size", f"{SIDE}x{SIDE}", "--samples", samples, "--seed", seed)
                    fast = render(of, folder, "--size", f"{FINE}x{FINE}", "--samples", 1)
                    truth, chance, light = light_of(paths), error_of(paths), light_of(fast)
                    row.append(f"{view} {light / truth:.2f} ({chance / truth:.0%})")
                    sums.setdefault((view, sun), []).append((light / truth, chance / truth))
                print(f"{name_of(layer)}, sun {sun}: {', '.join(row)}", flush=True)
    for (view, sun), parts in sums.items():
        ratio = np.mean([p[0] for p in parts])
        chance = math.sqrt(sum(p[1] ** 2 for p in parts)) / len(parts)
        is_off = abs(ratio - 1) > MOST_OFF + 3 * chance
        failed += is_off
        print(f"mean, {view}, sun {sun}: {ratio:.3f} ({chance:.1%}){' OFF' if is_off else ''}")
    sys.exit(f"check_cloud_truth: {failed} means are off by more than {MOST_OFF:.0%}" if failed else 0)


if __name__ == "__main__":
    main()
