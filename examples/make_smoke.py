#!/usr/bin/env python3
"""make_smoke.py OUT.raw: the smoke of the grid scene, 64 x 112 x 64 voxels of 8 bits. A plume that rises from a fire at the bottom, is bent by
the wind, widens and breaks into billows.

No dependencies, the same bytes everywhere.
"""
import math
import os
import sys

WIDTH, HEIGHT = 64, 112
PUFFS = 150


def dice(state):
    """Numbers within 0 and 1."""
    while True:
        state = (state * 6364136223846793005 + 1442695040888963407) & 0xFFFFFFFFFFFFFFFF
        yield (state >> 33) / 0x80000000


def puffs():
    """Balls of smoke along the plume: centre, radius [voxels], strength."""
    numbers = dice(7)
    for i in range(PUFFS):
        up = (i + next(numbers)) / PUFFS
        reach = 2 + 13 * up ** 0.8  # of the plume about its middle
        turn, away = 2 * math.pi * next(numbers), reach * math.sqrt(next(numbers))
        yield (20 + 26 * up * up + away * math.cos(turn), 3 + (HEIGHT - 16) * up + 3 * (next(numbers) - 0.5),
               32 + 4 * math.sin(5 * up) + away * math.sin(turn), 2.4 + 6.5 * up * (0.5 + next(numbers)), 1 - 0.72 * up)


def add(field, puff):
    cx, cy, cz, radius, strength = puff
    for z in range(max(0, math.ceil(cz - radius)), min(WIDTH, math.floor(cz + radius) + 1)):
        for y in range(max(0, math.ceil(cy - radius)), min(HEIGHT, math.floor(cy + radius) + 1)):
            row = (z * HEIGHT + y) * WIDTH
            for x in range(max(0, math.ceil(cx - radius)), min(WIDTH, math.floor(cx + radius) + 1)):
                inside = 1 - ((x - cx) ** 2 + (y - cy) ** 2 + (z - cz) ** 2) / radius ** 2
                if inside > 0:
                    field[row + x] += strength * inside * inside


def main():
    if len(sys.argv) != 2:
        sys.exit("usage: make_smoke.py OUT.raw")
    field = [0.0] * (WIDTH * HEIGHT * WIDTH)
    for puff in puffs():
        add(field, puff)
    path = sys.argv[1]
    os.makedirs(os.path.dirname(path) or ".", exist_ok=True)
    with open(path + ".part", "wb") as out:
        out.write(bytes(min(255, int(160 * value)) for value in field))
    os.replace(path + ".part", path)


if __name__ == "__main__":
    main()
