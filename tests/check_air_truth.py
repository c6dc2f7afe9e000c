#!/usr/bin/env python3
"""Compares the air of planets, fast and precise, with the reference path tracer over random views and suns.

check_air_truth.py [VIEWS] [SIDE] [SEED]: so many views of each atmosphere (3), pictures of SIDE x SIDE pixels of 64 samples
along each ray (40), random numbers from a seed (1). Prints for each view and color channel what the reference says with its
standard error, and how far both qualities are from it. Fails if the Earth by day is farther off than `error` tells and four
standard errors.
"""

import json
import math
import os
import pathlib
import random
import subprocess
import sys
import tempfile

import numpy as np

from picture_files import read_exr

NEBEL = os.environ["NEBEL"]
RADII = {"earth": 6.36e6, "mars": 3.3895e6, "toy": 1e3, "haze": 6.36e6}
FIELD = 0.01  # of view, degrees
DEPTHS = {"earth": 1e5, "mars": 1.2e5, "toy": 125, "haze": 1e5}


def haze():
    """White haze of optical depth 1 over black ground, g 0.8."""
    height = 1e4
    scattering = 1 / (height * -math.expm1(-DEPTHS["haze"] / height))
    return {"components": [{"type": "exponential", "scattering": scattering, "scale_height": height,
                      "phase": {"type": "henyey_greenstein", "g": 0.8}}], "ground_albedo": 0}


def planet_of(name):
    return {"model": "physical", **(haze() if name == "haze" else {"preset": name})}


class View:
    """A ray and a sun. Heights are from the ground to beyond the air, suns from six degrees below level up."""

    def __init__(self, name, dice):
        deep, radius = DEPTHS[name], RADII[name]
        self.name = name
        self.height = dice.choice([2e-5 * deep, dice.uniform(0.01, 0.3) * deep, dice.uniform(1.5, 5) * deep])
        self.sun = dice.choice([dice.uniform(-6, 0), dice.uniform(0, 10), dice.uniform(10, 90)])
        self.azimuth = dice.uniform(0, 180)
        horizon = -math.degrees(math.acos(radius / (radius + self.height)))
        past_air = -math.degrees(math.acos(min(1, (radius + deep) / (radius + self.height))))
        highest = past_air if self.height > deep else 90
        # Off the horizon, so that all of the picture is on one side of it.
        self.elevation = horizon + 2 * FIELD + (highest - horizon) * dice.random() ** 2
        if dice.random() < 0.3:
            self.elevation = horizon - 2 * FIELD + (-90 - horizon) * dice.random() ** 2

    def scene(self, quality):
        sun, up, turn = (math.radians(x) for x in (self.sun, self.elevation, self.azimuth))
        ahead = [math.cos(up) * math.cos(turn), math.sin(up), math.cos(up) * math.sin(turn)]
        camera = {"position": [0, self.height, 0], "look_at": [ahead[0], self.height + ahead[1], ahead[2]],
                  "up": [1, 0, 0] if abs(ahead[1]) > 0.9 else [0, 1, 0], "vertical_fov": FIELD}
        return {"nebel": 1, "fog": [], "camera": camera, "planet": {**planet_of(self.name), "quality": quality},
                "sun": {"direction": [math.cos(sun), math.sin(sun), 0], "irradiance": 1}}

    def __str__(self):
        return (f"{self.name:5} height {self.height:9.4g} elevation {self.elevation:7.2f} azimuth {self.azimuth:5.1f} "
                f"sun {self.sun:5.1f}")


def render(scene, folder, *options):
    """The planes of a picture, by name."""
    path, picture = folder / "scene.json", folder / "picture.exr"
    path.write_text(json.dumps(scene))
    subprocess.run([NEBEL, "render", path, "-o", picture, "--quiet", "--aov", *map(str, options)], check=True)
    return read_exr(picture.read_bytes())


def light_of(planes):
    return np.array([planes["in_scattering." + c].astype(float).mean() for c in "RGB"])


def error_of(planes):
    """Of the mean over a picture, each channel. That of all light, the ground's too: no less than that of the air's."""
    squares = [(planes["standard_error." + c].astype(float) ** 2).sum() for c in "RGB"]
    return np.sqrt(squares) / planes["R"].size


def part_of(numbers, truth, chance, form):
    """In terms of the truth; of what chance hides a dot."""
    return " ".join("  ." if e > 0.3 * t else format(x / t, form) for x, t, e in zip(numbers, truth, chance))


class Tally:
    """Of the views of one atmosphere in one quality."""

    def __init__(self):
        self.parts, self.told, self.beyond = [], 0.0, 0

    def add(self, off, truth, chance, told):
        """Parts count where chance hides less than 3 %; two standard errors are taken off."""
        known = chance < 0.03 * truth
        if known.any():
            self.parts.append(float(np.max((np.maximum(0, np.abs(off) - 2 * chance) / np.maximum(truth, 1e-30))[known])))
        self.told = max(self.told, float(np.max(np.abs(off) - 2 * chance)) / told)
        self.beyond += bool(np.any(np.abs(off) - told > 3 * np.maximum(chance, 1e-30)))

    def __str__(self):
        median, most = np.percentile(self.parts or [0], [50, 90])
        return f"{median:6.1%} {most:6.1%} {max(self.parts or [0]):6.1%} {max(0, self.told):5.2f} {self.beyond:3}"


def judge(view, side, folder, tallies):
    """Prints a view. The most by which a quality is beyond what it tells, in standard errors."""
    answers = {}
    for quality in tallies:
        planes = render(view.scene(quality), folder, "--size", "1x1", "--samples", 1)
        answers[quality] = light_of(planes), float(planes["error"].max())
    # Where few paths meet air at all, as in two metres of it, the most light is of the fewest of them, whose spread a sample does not show:
    # what seems to be beyond is looked at again with 16 times as many, and once more.
    for finer in (1, 4, 16):
        paths = render(view.scene("fast"), folder, "--method", "path", "--size", f"{finer * side}x{finer * side}",
                       "--samples", 64)
        truth, chance = light_of(paths), error_of(paths)
        beyond = {quality: float(np.max((np.abs(light - truth) - told) / np.maximum(chance, 1e-30)))
                  for quality, (light, told) in answers.items()}
        if max(beyond.values()) <= 3:
            break
    row = []
    for quality, (light, told) in answers.items():
        off = light - truth
        tallies[quality].add(off, truth, chance, told)
        row.append(f"{quality} {part_of(off, truth, chance, '+7.1%')} told {told:.1e}" + (f" BEYOND by {beyond[quality]:.1f}" if beyond[quality] > 3 else ""))
    seen = " ".join(f"{x:.3e}" for x in truth)
    print(f"{view}: {seen} ({part_of(chance, truth, chance, '.1%')}) | {' | '.join(row)}", flush=True)
    return beyond


def main():
    numbers = [int(x) for x in sys.argv[1:]]
    views, side, seed = (numbers + [3, 40, 1][len(numbers):])[:3]
    failed, tallies = 0, {name: {"fast": Tally(), "precise": Tally()} for name in RADII}
    with tempfile.TemporaryDirectory() as folder:
        for name in RADII:
            dice = random.Random(f"{seed} {name}")
            for _ in range(views):
                view = View(name, dice)
                beyond = judge(view, side, pathlib.Path(folder), tallies[name])
                failed += name == "earth" and view.sun > 0 and max(beyond.values()) > 4
    print(f"{views} views each, beyond two standard errors: the part of the light that is off, in the median, of 90 in 100 and at most;"
          " the most of what is told; views beyond what is told and three standard errors")
    for name, of in tallies.items():
        print(f"{name:6}", *(f"{quality:7} {tally} " for quality, tally in of.items()))
    sys.exit(f"check_air_truth: {failed} views of the Earth by day are beyond what is told" if failed else 0)


if __name__ == "__main__":
    main()
