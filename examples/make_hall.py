#!/usr/bin/env python3
"""make_hall.py OUT.obj: a hall with columns and a floor of tiles, for the scenes with fog in cells.

Everything is made of quads of half a metre, since classic fog is as fine as the vertices are. The light of the hall is in its colours: what
faces +x, +y or z is of three different tones. Writes OUT.mtl beside it. No dependencies, the same bytes everywhere.
"""
import os
import sys

LENGTH, WIDTH, HEIGHT = 24.0, 12.0, 9.0  # x, z, y
STEP = 0.5
COLUMNS = [(x, z) for x in (-9.0, -3.0, 3.0, 9.0) for z in (-4.0, 4.0)]
SIDE = 0.5  # half of a column's

MATERIALS = {
    "floor_dark": (0.050, 0.036, 0.030), "floor_light": (0.070, 0.052, 0.040),
    "wall_x": (0.22, 0.13, 0.09), "wall_z": (0.33, 0.19, 0.12), "cornice": (0.45, 0.32, 0.18),
    "column_x": (0.16, 0.18, 0.16), "column_z": (0.28, 0.31, 0.27), "column_y": (0.40, 0.42, 0.38),
}


class Mesh:
    def __init__(self, materials):
        self.materials = materials
        self.places, self.lines, self.faces = {}, [], {name: [] for name in materials}

    def vertex(self, place):
        key = tuple(round(x, 4) for x in place)
        if key not in self.places:
            self.places[key] = len(self.places) + 1
            self.lines.append("v %g %g %g" % key)
        return self.places[key]

    def rectangle(self, corner, u, v, counts, material):
        """counts quads along the vectors u and v; material takes the place of a quad and gives its name."""
        for i in range(counts[0]):
            for j in range(counts[1]):
                at = [[c + (i + a) / counts[0] * x + (j + b) / counts[1] * y for c, x, y in zip(corner, u, v)]
                      for a, b in ((0, 0), (1, 0), (1, 1), (0, 1))]
                self.faces[material(i, j, counts)].append([self.vertex(place) for place in at])


def quads(length):
    return int(round(length / STEP))


def build():
    mesh = Mesh(MATERIALS)
    x, z = LENGTH / 2, WIDTH / 2
    tile = lambda i, j, counts: "floor_light" if (i // 3 + j // 3) % 2 else "floor_dark"
    wall = lambda name: lambda i, j, counts: "cornice" if j in (counts[1] - 1, counts[1] // 3) else name
    plain = lambda name: lambda i, j, counts: name
    mesh.rectangle((-x, 0, -z), (LENGTH, 0, 0), (0, 0, WIDTH), (quads(LENGTH), quads(WIDTH)), tile)
    for side in (-x, x):
        mesh.rectangle((side, 0, -z), (0, 0, WIDTH), (0, HEIGHT, 0), (quads(WIDTH), quads(HEIGHT)), wall("wall_x"))
    for side in (-z, z):
        mesh.rectangle((-x, 0, side), (LENGTH, 0, 0), (0, HEIGHT, 0), (quads(LENGTH), quads(HEIGHT)), wall("wall_z"))
    for cx, cz in COLUMNS:
        tall = 0.7 * HEIGHT
        size = (quads(2 * SIDE), quads(tall))
        for side in (-SIDE, SIDE):
            mesh.rectangle((cx + side, 0, cz - SIDE), (0, 0, 2 * SIDE), (0, tall, 0), size, plain("column_x"))
            mesh.rectangle((cx - SIDE, 0, cz + side), (2 * SIDE, 0, 0), (0, tall, 0), size, plain("column_z"))
        mesh.rectangle((cx - SIDE, tall, cz - SIDE), (2 * SIDE, 0, 0), (0, 0, 2 * SIDE), (2, 2), plain("column_y"))
    return mesh


def write(mesh, path):
    stem = os.path.splitext(path)[0]
    with open(stem + ".mtl", "w") as out:
        for name, color in mesh.materials.items():
            out.write("newmtl %s\nKd %g %g %g\n" % (name, *color))
    with open(path, "w") as out:
        out.write("mtllib %s\n" % os.path.basename(stem + ".mtl"))
        out.write("\n".join(mesh.lines) + "\n")
        for name, faces in mesh.faces.items():
            out.write("usemtl %s\n" % name)
            out.writelines("f %d %d %d %d\n" % tuple(face) for face in faces)


if __name__ == "__main__":
    write(build(), sys.argv[1])
