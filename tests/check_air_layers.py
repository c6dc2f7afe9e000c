#!/usr/bin/env python3
"""Compares the reference path tracer with adding and doubling of flat layers, for random mixtures of air over gray ground.

check_air_layers.py [MIXTURES] [SIDE] [SEED]: so many mixtures (2), pictures of SIDE x SIDE pixels of 64 samples (24), random
numbers from a seed (1). A planet of 1e10 m has flat air: Rayleigh's and dust of Henyey and Greenstein's phase function, of
one scale height, with coefficients of their own for each color. Seen straight down from above and straight up from the
ground light depends on no azimuth. Hansen and Travis, "Light scattering in planetary atmospheres", 1974, section 3.
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
from numpy.polynomial import legendre

from picture_files import read_exr

NEBEL = os.environ["NEBEL"]
HEIGHT, TOP = 1e4, 1e5
NODES, DOUBLINGS = 32, 26


class Layer:
    """What a layer sends back and lets through, of slopes `cosines`: those of Gauss's rule, straight, the sun's."""

    def __init__(self, depth, albedo, moments, sun):
        nodes, weights = legendre.leggauss(NODES)
        self.cosines = np.concatenate([(nodes + 1) / 2, [1, sun]])
        self.weights = np.concatenate([weights / 2, [0, 0]]) * self.cosines * 2
        self.depth = depth
        self.double(albedo, moments)

    def times(self, a, b):
        return (a * self.weights) @ b

    def double(self, albedo, moments):
        cosines, thin = self.cosines, self.depth / 2 ** DOUBLINGS
        values = legendre.legvander(cosines, len(moments) - 1)
        signs = (-1.0) ** np.arange(len(moments))
        factor = albedo * thin / (4 * np.outer(cosines, cosines))
        back = factor * ((values * moments * signs) @ values.T)
        through = factor * ((values * moments) @ values.T)
        for _ in range(DOUBLINGS):
            left = np.exp(-thin / cosines)
            loop = self.times(back, back)
            loops = np.linalg.solve(np.eye(len(cosines)) - loop * self.weights, loop)
            down = through + loops * left + self.times(loops, through)
            up = back * left + self.times(back, down)
            back = back + left[:, None] * up + self.times(through, up)
            through = left[:, None] * down + through * left + self.times(through, down)
            thin *= 2
        self.back, self.through = back, through


def expected_of(layer, ground):
    """Radiance straight down and straight up, for a sun of irradiance 1; the ground counts in both."""
    sun, ahead = layer.cosines[-1], NODES
    falls = sun * (math.exp(-layer.depth / sun) + layer.weights @ layer.through[:, -1])
    sent_back = layer.weights @ layer.back @ layer.weights
    lit = ground * falls / (1 - ground * sent_back) / math.pi
    down = sun * layer.back[ahead, -1] / math.pi
    up = sun * layer.through[ahead, -1] / math.pi
    return (down + lit * (math.exp(-layer.depth) + layer.through[ahead] @ layer.weights),
            up + lit * (layer.back[ahead] @ layer.weights))


class Mixture:
    def __init__(self, dice):
        self.sun, self.ground, self.g = dice.uniform(0.15, 0.95), dice.uniform(0, 0.9), dice.uniform(-0.4, 0.7)
        self.depths = [[dice.uniform(0.02, 0.6) for _ in range(3)] for _ in range(2)]
        self.albedos = [[dice.uniform(0.6, 1) for _ in range(3)] for _ in range(2)]

    def expected(self, channel):
        orders = np.arange(2 * NODES)
        phases = [np.where(orders == 0, 1.0, np.where(orders == 2, 0.5, 0)), (2 * orders + 1) * self.g ** orders]
        scattered = [self.depths[k][channel] * self.albedos[k][channel] for k in range(2)]
        depth = self.depths[0][channel] + self.depths[1][channel]
        moments = sum(s * p for s, p in zip(scattered, phases)) / sum(scattered)
        return expected_of(Layer(depth, sum(scattered) / depth, moments, self.sun), self.ground)

    def scene(self, is_down):
        column = HEIGHT * -math.expm1(-TOP / HEIGHT)
        phases = [{"type": "rayleigh"}, {"type": "henyey_greenstein", "g": self.g}]
        airs = [{"type": "exponential", "scale_height": HEIGHT, "phase": phase,
                 "scattering": [d * a / column for d, a in zip(depths, albedos)],
                 "absorption": [d * (1 - a) / column for d, a in zip(depths, albedos)]}
                for phase, depths, albedos in zip(phases, self.depths, self.albedos)]
        height = 2 * TOP if is_down else 0.01
        return {"nebel": 1, "fog": [],
                "camera": {"position": [0, height, 0], "look_at": [0, height + (-1 if is_down else 1), 0],
                           "up": [1, 0, 0], "vertical_fov": 0.01},
                "sun": {"direction": [math.sqrt(1 - self.sun ** 2), self.sun, 0], "irradiance": 1},
                "planet": {"model": "physical", "radius": 1e10, "thickness": TOP, "components": airs,
                           "ground_albedo": self.ground, "sun_angular_diameter": 0}}


def render(scene, side, folder):
    """Means over a picture and their standard errors, each color."""
    path, picture = folder / "scene.json", folder / "picture.exr"
    path.write_text(json.dumps(scene))
    subprocess.run([NEBEL, "render", path, "-o", picture, "--quiet", "--aov", "--method", "path", "--size",
                    f"{side}x{side}", "--samples", "64"], check=True)
    planes = read_exr(picture.read_bytes())
    light = [planes[c].astype(float).mean() for c in "RGB"]
    chance = [math.sqrt((planes["standard_error." + c].astype(float) ** 2).sum()) / side ** 2 for c in "RGB"]
    return light, chance


def main():
    numbers = [int(x) for x in sys.argv[1:]]
    mixtures, side, seed = (numbers + [2, 24, 1][len(numbers):])[:3]
    worst = 0
    with tempfile.TemporaryDirectory() as folder:
        for number in range(mixtures):
            mixture = Mixture(random.Random(f"{seed} {number}"))
            expected = np.array([mixture.expected(c) for c in range(3)])
            for view in range(2):
                light, chance = render(mixture.scene(view == 0), side, pathlib.Path(folder))
                for c in range(3):
                    off = (light[c] - expected[c][view]) / chance[c]
                    worst = max(worst, abs(off))
                    print(f"{'up' if view else 'down'} {'RGB'[c]}: {light[c]:.5f} ({chance[c] / light[c]:.1%}), "
                          f"doubling {expected[c][view]:.5f}, off {off:+.1f} standard errors", flush=True)
    sys.exit(f"check_air_layers: off by {worst:.1f} standard errors" if worst > 4.5 else 0)


if __name__ == "__main__":
    main()
