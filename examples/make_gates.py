#!/usr/bin/env python3
"""make_gates.py OUT.gltf: a path through gates, with lanterns beside it, for the scene of the same name.

The model brings its own fog: nodes without a mesh whose extras are what Blender writes for the custom properties of an empty. The
light of each lantern is two spheres that hang on the lantern; the mist is a box. No dependencies, the same bytes everywhere.
"""
import base64
import json
import math
import os
import struct
import sys

GATES, STEP = 6, 4.0  # how many, m apart
LANTERNS = 7


def lathe(profile, sides):
    """Flat faces of a polygon turned about y: lists of positions, normals, triangles."""
    positions, normals = [], []
    for (r0, y0), (r1, y1) in zip(profile, profile[1:]):
        for i in range(sides):
            a, b, m = (2 * math.pi * (i + k) / sides for k in (0, 1, 0.5))
            # Outwards: the profile runs upwards, its tangent is (r1 - r0, y1 - y0).
            length = math.hypot(r1 - r0, y1 - y0)
            normal = ((y1 - y0) / length * math.cos(m), (r0 - r1) / length, (y1 - y0) / length * math.sin(m))
            corner = [(r * math.cos(t), y, r * math.sin(t)) for r, y, t in ((r0, y0, a), (r1, y1, a), (r1, y1, b), (r0, y0, b))]
            for k in (0, 1, 2, 0, 2, 3):
                positions.append(corner[k])
                normals.append(normal)
    return positions, normals


def box(low, high):
    positions, normals = [], []
    for axis in range(3):
        for sign in (-1, 1):
            normal = [0, 0, 0]
            normal[axis] = sign
            u, v = [i for i in range(3) if i != axis]
            corner = []
            for s, t in ((0, 0), (1, 0), (1, 1), (0, 1)):
                p = [0, 0, 0]
                p[axis] = (high if sign > 0 else low)[axis]
                p[u], p[v] = (high if s else low)[u], (high if t else low)[v]
                corner.append(p)
            order = (0, 1, 2, 0, 2, 3) if (sign > 0) == (axis != 1) else (0, 2, 1, 0, 3, 2)
            positions += [corner[k] for k in order]
            normals += [normal] * 6
    return positions, normals


def moved(part, x, y, z):
    return [(p[0] + x, p[1] + y, p[2] + z) for p in part[0]], part[1]


def joined(*parts):
    return [p for part in parts for p in part[0]], [n for part in parts for n in part[1]]


def gate():
    pillar = lathe([(0.21, 0), (0.21, 0.25), (0.16, 0.25), (0.14, 3.3)], 20)
    return joined(moved(pillar, -1.35, 0, 0), moved(pillar, 1.35, 0, 0), box((-1.75, 2.55, -0.09), (1.75, 2.80, 0.09)),
                  box((-2.15, 3.25, -0.17), (2.15, 3.42, 0.17)), box((-2.30, 3.42, -0.21), (2.30, 3.54, 0.21)),
                  box((-0.16, 2.80, -0.05), (0.16, 3.25, 0.05)))


def lantern():
    return lathe([(0.30, 0), (0.30, 0.12), (0.11, 0.20), (0.09, 0.78), (0.27, 0.86), (0.27, 0.93), (0.15, 0.95), (0.15, 1.22),
                  (0.43, 1.26), (0.08, 1.50), (0.06, 1.58), (0, 1.64)], 6)


def stones():
    """Slabs along the path, none like the other."""
    parts = []
    for i in range(34):
        z, w = 4.5 - i * 0.95, 0.62 + 0.16 * math.sin(i * 2.4)
        x = 0.10 * math.sin(i * 1.7)
        parts.append(box((x - w, -0.05, z - 0.38 - 0.05 * math.sin(i)), (x + w, 0.05 + 0.012 * math.sin(i * 3.1), z + 0.38)))
    return joined(*parts)


class Model:
    def __init__(self):
        self.data = b""
        self.gltf = {"asset": {"version": "2.0", "generator": "make_gates.py of nebel"}, "scene": 0, "scenes": [{"nodes": []}], "nodes": [],
                     "meshes": [], "materials": [], "accessors": [], "bufferViews": []}

    def add(self, kind, item):
        self.gltf[kind].append(item)
        return len(self.gltf[kind]) - 1

    def vectors(self, rows):
        packed = b"".join(struct.pack("<3f", *row) for row in rows)
        view = self.add("bufferViews", {"buffer": 0, "byteOffset": len(self.data), "byteLength": len(packed)})
        self.data += packed
        columns = [struct.unpack(f"<{len(rows)}f", b"".join(struct.pack("<f", row[i]) for row in rows)) for i in range(3)]
        return self.add("accessors", {"bufferView": view, "componentType": 5126, "count": len(rows), "type": "VEC3",
                                      "min": [min(c) for c in columns], "max": [max(c) for c in columns]})

    def mesh(self, name, part, color):
        material = self.add("materials", {"name": name, "pbrMetallicRoughness": {"baseColorFactor": [*color, 1], "metallicFactor": 0}})
        primitive = {"attributes": {"POSITION": self.vectors(part[0]), "NORMAL": self.vectors(part[1])}, "material": material}
        return self.add("meshes", {"name": name, "primitives": [primitive]})

    def node(self, parent=None, **members):
        index = self.add("nodes", members)
        if parent is None:
            self.gltf["scenes"][0]["nodes"].append(index)
        else:
            self.gltf["nodes"][parent].setdefault("children", []).append(index)
        return index

    def write(self, path):
        uri = "data:application/octet-stream;base64," + base64.b64encode(self.data).decode()
        self.gltf["buffers"] = [{"byteLength": len(self.data), "uri": uri}]
        with open(path + ".part", "w") as file:
            json.dump(self.gltf, file, separators=(",", ":"))
        os.replace(path + ".part", path)


def main():
    model = Model()
    ground = model.mesh("ground", box((-90, -0.2, -120), (90, 0, 30)), (0.035, 0.045, 0.03))
    path = model.mesh("stones", stones(), (0.22, 0.22, 0.23))
    red = model.mesh("gate", gate(), (0.42, 0.06, 0.03))
    stone = model.mesh("lantern", lantern(), (0.26, 0.26, 0.25))
    model.node(name="Ground", mesh=ground)
    model.node(name="Stones", mesh=path)
    for i in range(GATES):
        model.node(name=f"Gate {i + 1}", mesh=red, translation=[0, 0, -i * STEP])
    for i in range(LANTERNS):
        for side in (-1, 1):
            x, z, turn = side * (2.25 + 0.1 * math.sin(i * 5 + side)), 2 - i * STEP, 0.26 * i + side
            holder = model.node(name=f"Lantern {i + 1} {'left' if side < 0 else 'right'}", translation=[x, 0, z],
                                rotation=[0, math.sin(turn / 2), 0, math.cos(turn / 2)])
            model.node(holder, name="Stone", mesh=stone)
            # What an artist types into the custom properties of a spherical empty.
            model.node(holder, name="Flame", translation=[0, 1.08, 0], scale=[0.34, 0.34, 0.34], extras={
                "nebel_shape": "sphere", "nebel_density": "radial", "nebel_extinction": 0.3, "nebel_emission": [4.2, 2.3, 0.9]})
            # The same as one property, in the words of a scene file: for what takes more than a number.
            model.node(holder, name="Glow", translation=[0, 1.08, 0], scale=[1.5, 1.5, 1.5], extras={"nebel": json.dumps({
                "shape": "sphere", "density": {"type": "radial", "power": 3}, "extinction": 0.05, "emission": [0.62, 0.26, 0.08]})})
    model.node(name="Mist", translation=[0, 1.5, -20], scale=[60, 1.5, 45], extras={"nebel": json.dumps({
        "shape": "box", "density": {"type": "height", "base": -1.5, "scale_height": 0.5}, "visibility": 12, "source": "#5f6f92"})})
    model.write(sys.argv[1])


if __name__ == "__main__":
    main()
