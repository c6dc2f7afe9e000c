#!/usr/bin/env python3
"""Shows that a change of the code changed no number: records what a build computes, and compares two records bit by bit.

golden.py record BUILD FOLDER [--scenes N] [--seed N] [--gl]
golden.py compare BEFORE AFTER

A record holds, of every example scene, of every scene of the fuzzers' corpus and of N random ones (default: 200), the light along
64 rays, in double and in float on every instruction set of this processor, and of the example scenes small pictures by ray tracing
and, with --gl, by OpenGL. Scenes are those of the checkout in which the script lies, so that each checkout reads its own keys.
`compare` names each difference with its size, and exits 1 where there is one."""

import argparse
import concurrent.futures
import csv
import hashlib
import json
import math
import os
import pathlib
import random
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
RAYS = 64
SIZE = "96x54"
# The name of an example of a classic technique begins with that of its method, as in demo.sh.
METHODS = {"cells": "cells", "linear": "linear", "vertex": "vertex"}
CLASSIC = ["vertex", "additive", "exp2", "fog-coord", "two-pass", "alpha"]


def unit(dice):
    while True:
        v = [dice.gauss(0, 1) for _ in range(3)]
        length = math.hypot(*v)
        if length > 0.1:
            return [x / length for x in v]


def near(dice, size):
    return [dice.uniform(-size, size) for _ in range(3)]


def random_shape(dice, size, deep=0):
    at, r = near(dice, size), size * dice.uniform(0.2, 1)
    ends = {"from": at, "to": [a + r * b for a, b in zip(at, unit(dice))]}
    kind = dice.choice(["sphere", "box", "ellipsoid", "cylinder", "capsule", "cone", "half_space", "world", "union", "intersection"])
    if kind in ("union", "intersection"):
        if deep == 2:
            return {"type": "sphere", "center": at, "radius": r}
        return {"type": kind, "shapes": [random_shape(dice, size, deep + 1) for _ in range(dice.randint(2, 3))]}
    return {"sphere": {"center": at, "radius": r},
            "box": {"min": at, "max": [a + r * dice.uniform(0.2, 2) for a in at]},
            "ellipsoid": {"center": at, "radii": [r * dice.uniform(0.3, 1) for _ in range(3)]},
            "cylinder": {**ends, "radius": r},
            "capsule": {**ends, "radius": r},
            "cone": {**ends, "radius_from": r, "radius_to": r * dice.choice([0, 0.4])},
            "half_space": {"point": at, "normal": unit(dice)},
            "world": {}}[kind] | {"type": kind}


def random_density(dice, size, shape):
    at = near(dice, size)
    densities = [
        {"type": "constant"},
        {"type": "height", "base": at[1], "scale_height": size * dice.uniform(0.1, 2)},
        {"type": "linear", "from": at, "to": near(dice, size)},
        {"type": "gaussian", "center": at, "sigma": size * dice.uniform(0.2, 1)}]
    if shape in ("sphere", "ellipsoid"):
        densities.append({"type": "radial"})
    if shape in ("sphere", "box", "capsule"):
        densities.append({"type": "soft_edge", "distance": size * dice.uniform(0.05, 0.5)})
    return dice.choice(densities)


def random_volume(dice, size):
    color = lambda top: [top * dice.random() for _ in range(3)]
    shape = random_shape(dice, size)
    volume = {"shape": shape, "extinction": color(10 ** dice.uniform(-2, 2) / size),
              "density": random_density(dice, size, shape["type"])}
    if dice.random() < 0.7:
        volume["albedo"] = color(1)
        volume["phase"] = dice.choice([{"type": "isotropic"}, {"type": "henyey_greenstein", "g": dice.uniform(-0.8, 0.9)},
                                       {"type": "rayleigh"}])
    else:
        volume["source"] = color(1)
    return volume


def random_scene(dice):
    size = 10 ** dice.uniform(-1, 3)
    scene = {"nebel": 1, "fog": [random_volume(dice, size) for _ in range(dice.choice([1, 2, 3, 8]))]}
    if dice.random() < 0.6:
        scene["sun"] = {"direction": unit(dice), "irradiance": [3, 2, 1]}
    if dice.random() < 0.4:
        scene["lights"] = [{"type": "point", "position": near(dice, size), "intensity": size * size}
                           for _ in range(dice.randint(1, 2))]
    if dice.random() < 0.4:
        scene["ambient"] = dice.choice([[0.1, 0.2, 0.3],
                                        {"type": "gradient", "zenith": [0.1, 0.2, 0.5], "horizon": [0.5, 0.4, 0.3], "ground": 0.05}])
    return scene, size


def random_rays(dice, middle, size):
    lines = []
    for _ in range(RAYS):
        origin = [m + dice.gauss(0, size) for m in middle]
        length = dice.choice([math.inf, size * dice.uniform(0, 5)])
        lines.append(" ".join(repr(x) for x in [*origin, *unit(dice), length]))
    return "\n".join(lines) + "\n"


def jobs(arguments, folder):
    """Pairs (name of a result, command, standard input)."""
    nebel = str(pathlib.Path(arguments.build, "nebel").resolve())
    information = subprocess.run([nebel, "info"], capture_output=True, text=True, check=True).stdout
    isas = re.search(r"instruction sets: (.*)", information).group(1).split()
    scenes = []
    for path in sorted([*ROOT.glob("examples/scenes/*.json"), *ROOT.glob("fuzz/corpus/scene/*.json")]):
        camera = re.search(r'"camera"\s*:\s*{[^}]*"position"\s*:\s*\[([^\]]*)\]', path.read_text())
        middle = [float(x) for x in camera.group(1).split(",")] if camera else [0, 1.7, 0]
        scenes.append((path.stem, path, random_rays(random.Random(path.stem), middle, 10)))
    for i in range(arguments.scenes):
        dice = random.Random(f"{arguments.seed}/{i}")
        scene, size = random_scene(dice)
        path = folder / f"random-{i}.json"
        path.write_text(json.dumps(scene, indent=1))
        scenes.append((path.stem, path, random_rays(dice, [0, 0, 0], size)))
    for name, path, rays in scenes:
        yield f"{name}.double.csv", [nebel, "trace", path], rays
        for isa in isas:
            yield f"{name}.{isa}.csv", [nebel, "trace", path, "-p", "float", "--isa", isa], rays
    for path in sorted(ROOT.glob("examples/scenes/*.json")):
        methods = [METHODS.get(path.stem.split("-")[0], "exact")] + (CLASSIC if path.stem == "ground-fog" else [])
        devices = ["cpu"] + (["gl"] if arguments.gl else [])
        for method in methods:
            for device in devices:
                name = f"{path.stem}.{method}.{device}.exr"
                yield name, [nebel, "render", path, "-o", folder / name, "-s", SIZE, "--samples", "2", "--method", method,
                             "--device", device], ""


def record(arguments):
    folder = pathlib.Path(arguments.folder)
    folder.mkdir(parents=True)

    def run(job):
        name, command, text = job
        done = subprocess.run([str(x) for x in command], input=text, capture_output=True, text=True)
        if done.returncode != 0:
            # What is refused is part of the record, but for the message, which names files.
            (folder / name).with_suffix(".error").write_text(f"status {done.returncode}\n")
            print(f"{name}: {done.stderr.splitlines()[-1] if done.stderr else 'no message'}")
        elif name.endswith(".csv"):
            (folder / name).write_text(done.stdout)
        return done.returncode == 0

    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        fine = list(pool.map(run, jobs(arguments, folder)))
    print(f"{sum(fine)} results, {len(fine) - sum(fine)} refused")


def difference(one, other):
    """How far two results are apart, as text."""
    if one.suffix != ".csv":
        done = subprocess.run([NEBEL, "compare", str(one), str(other)], capture_output=True, text=True) if NEBEL else None
        return done.stdout.replace("\n", "; ") if done else "other bytes"
    worst = 0
    with open(one, newline="") as a, open(other, newline="") as b:
        for row, twin in zip(csv.DictReader(a), csv.DictReader(b)):
            for key in row:
                x, y = float(row[key]), float(twin[key])
                worst = max(worst, abs(x - y) if x == x and y == y else math.inf)
    return f"largest difference {worst:g}"


def compare(arguments):
    before, after = pathlib.Path(arguments.before), pathlib.Path(arguments.after)
    digest = lambda path: hashlib.sha256(path.read_bytes()).digest()
    results = lambda folder: {path.name for path in folder.iterdir() if path.suffix != ".json"}
    both, either = results(before) & results(after), results(before) | results(after)
    different = 0
    for name in sorted(either):
        if name not in both:
            print(f"{name}: only in {before if (before / name).exists() else after}")
        elif digest(before / name) != digest(after / name):
            print(f"{name}: {difference(before / name, after / name)}")
        else:
            continue
        different += 1
    print(f"{len(either)} results, {different} differ")
    return different > 0


parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
commands = parser.add_subparsers(dest="command", required=True)
recording = commands.add_parser("record")
recording.add_argument("build")
recording.add_argument("folder")
recording.add_argument("--scenes", type=int, default=200)
recording.add_argument("--seed", type=int, default=1)
recording.add_argument("--gl", action="store_true")
comparing = commands.add_parser("compare")
comparing.add_argument("before")
comparing.add_argument("after")
comparing.add_argument("--nebel", help="a program whose `nebel compare` measures pictures that differ")
arguments = parser.parse_args()
if arguments.command == "record":
    record(arguments)
else:
    NEBEL = arguments.nebel
    sys.exit(compare(arguments))
