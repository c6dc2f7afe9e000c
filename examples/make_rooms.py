#!/usr/bin/env python3
"""make_rooms.py OUT.obj: three rooms in a row with a door and a window between the first two and an archway into the third.

For the scene with portals; quads, tones and OUT.mtl are as make_hall.py has them. No dependencies, the same bytes everywhere.
"""
import sys

from make_hall import Mesh, quads, write

HEIGHT, HALF = 4.0, 4.0  # y, and z on either side
WALLS = (-6.0, 0.0, 8.0, 16.0)  # x
# Openings in the walls at x = 0 and 8: z from, z to, y from, y to.
OPENINGS = {0.0: [(-2.5, -1.0, 0.0, 3.0), (0.5, 3.0, 1.0, 3.0)], 8.0: [(-1.5, 1.5, 0.0, 3.5)]}

MATERIALS = {
    "floor_dark": (0.09, 0.08, 0.08), "floor_light": (0.24, 0.22, 0.20), "ceiling": (0.42, 0.42, 0.40),
    "wall_x": (0.36, 0.35, 0.32), "wall_z": (0.24, 0.24, 0.23), "chest_x": (0.30, 0.15, 0.07), "chest_y": (0.45, 0.26, 0.12),
    "chest_z": (0.20, 0.10, 0.05),
}


def wall_with_openings(mesh, x, openings):
    """Strips between the openings' edges, each left out where an opening is."""
    steps = sorted({-HALF, HALF, *(z for o in openings for z in o[:2])})
    levels = sorted({0.0, HEIGHT, *(y for o in openings for y in o[2:])})
    for z0, z1 in zip(steps, steps[1:]):
        for y0, y1 in zip(levels, levels[1:]):
            if any(o[0] <= z0 and z1 <= o[1] and o[2] <= y0 and y1 <= o[3] for o in openings):
                continue
            mesh.rectangle((x, y0, z0), (0, 0, z1 - z0), (0, y1 - y0, 0), (quads(z1 - z0), quads(y1 - y0)), lambda *_: "wall_x")


def chest(mesh, x, z, size):
    for side in (-size, size):
        mesh.rectangle((x + side, 0, z - size), (0, 0, 2 * size), (0, 2 * size, 0), (2, 2), lambda *_: "chest_x")
        mesh.rectangle((x - size, 0, z + side), (2 * size, 0, 0), (0, 2 * size, 0), (2, 2), lambda *_: "chest_z")
    mesh.rectangle((x - size, 2 * size, z - size), (2 * size, 0, 0), (0, 0, 2 * size), (2, 2), lambda *_: "chest_y")


def build():
    mesh = Mesh(MATERIALS)
    for start, end in zip(WALLS, WALLS[1:]):
        counts, long = (quads(end - start), quads(2 * HALF)), (end - start, 0, 0)
        mesh.rectangle((start, 0, -HALF), long, (0, 0, 2 * HALF), counts,
                       lambda i, j, _: "floor_light" if (i // 2 + j // 2) % 2 else "floor_dark")
        mesh.rectangle((start, HEIGHT, -HALF), long, (0, 0, 2 * HALF), counts, lambda *_: "ceiling")
        for side in (-HALF, HALF):
            mesh.rectangle((start, 0, side), long, (0, HEIGHT, 0), (counts[0], quads(HEIGHT)), lambda *_: "wall_z")
    for x in WALLS:
        wall_with_openings(mesh, x, OPENINGS.get(x, []))
    for place in ((2.5, 2.0, 0.6), (5.5, -2.2, 0.5), (12.0, 0.4, 0.7)):
        chest(mesh, *place)
    return mesh


if __name__ == "__main__":
    write(build(), sys.argv[1])
