#!/usr/bin/env python3
"""make_tree.py OUT.glb: an old tree whose leaves are cards, for the scene with shafts through foliage.

A card is a square with the picture of a twig. The picture's alpha says what of the square is leaf: glTF's alphaMode MASK. Wood is
tapered tubes. Everything is in the one file, the picture as well. No dependencies, the same bytes everywhere.
"""
import json
import math
import os
import struct
import sys
import zlib

SIZE = 48  # texels of the picture either way
TRUNK, CROWN, RADII = 3.4, 5.4, (3.6, 2.3, 3.6)  # m: where it parts, the height of the crown's middle, its half axes
LIMBS, CARDS = 9, 120
NUMBERS = [1]


def dice(low=0.0, high=1.0):
    NUMBERS[0] = (NUMBERS[0] * 6364136223846793005 + 1442695040888963407) & 0xFFFFFFFFFFFFFFFF
    return low + (high - low) * (NUMBERS[0] >> 33) / 0x80000000


# ---- the picture of a twig -----------------------------------------------------------------------

def leaves():
    """Place, direction, length, half width, green of each leaf, in widths of the picture."""
    found = []
    for i in range(13):
        along, side = 0.10 + 0.062 * i, -1 if i % 2 else 1
        turn = math.pi / 2 - side * dice(0.6, 1.1) if i < 12 else math.pi / 2
        found.append((0.5 + 0.02 * math.sin(9 * along), along, turn, dice(0.24, 0.34) * (1.05 - 0.3 * along), dice(0.055, 0.075), dice(0.8, 1.2)))
    return found


def twig(found, x, y):
    """The green at a place; 0 where there is none."""
    for x0, y0, turn, length, wide, green in found:
        dx, dy = x - x0, y - y0
        u, v = (dx * math.cos(turn) + dy * math.sin(turn)) / length, -dx * math.sin(turn) + dy * math.cos(turn)
        if 0 < u < 1 and abs(v) < wide * 1.6 * math.sqrt(u) * (1 - u) ** 0.8:
            return green * (1 if abs(v) > 0.006 else 1.25)
    return 0.7 if abs(x - 0.5 - 0.02 * math.sin(9 * y)) < 0.009 and y < 0.9 else 0


def picture():
    """PNG: red, green, blue, alpha. Texels without a leaf are green as well, for the colour between texels."""
    found, rows = leaves(), b""
    for row in range(SIZE):
        rows += b"\0"
        for column in range(SIZE):
            greens = [twig(found, (column + (i + .5) / 3) / SIZE, 1 - (row + (k + .5) / 3) / SIZE) for i in range(3) for k in range(3)]
            there = [green for green in greens if green > 0]
            green = sum(there) / len(there) if there else 1
            rows += bytes(min(255, round(green * c)) for c in (92, 118, 46)) + bytes([round(255 * len(there) / 9)])

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    head = struct.pack(">IIBBBBB", SIZE, SIZE, 8, 6, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(rows, 9)) + chunk(b"IEND", b"")


# ---- vectors -------------------------------------------------------------------------------------

def add(a, b, by=1.0):
    return tuple(x + by * y for x, y in zip(a, b))


def unit(a):
    length = math.sqrt(sum(x * x for x in a))
    return tuple(x / length for x in a)


def cross(a, b):
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def across(axis):
    u = unit(cross(axis, (0.3, 0.1, 0.9)))
    return u, cross(axis, u)


# ---- the tree ------------------------------------------------------------------------------------

def tube(points, radii, sides=7):
    """Positions, normals and texture coordinates of corners, three a triangle."""
    rings = []
    for i, (point, radius) in enumerate(zip(points, radii)):
        u, v = across(unit(add(points[min(i + 1, len(points) - 1)], points[max(i - 1, 0)], -1)))
        turns = [(math.cos(2 * math.pi * k / sides), math.sin(2 * math.pi * k / sides)) for k in range(sides)]
        normals = [tuple(c * x + s * y for x, y in zip(u, v)) for c, s in turns]
        rings.append([(add(point, n, radius), n) for n in normals])
    corners = []
    for below, above in zip(rings, rings[1:]):
        for k in range(sides):
            a, b, c, d = below[k], below[(k + 1) % sides], above[(k + 1) % sides], above[k]
            corners += [(*p, (0, 0)) for p in (a, b, c, a, c, d)]
    return corners


def wood():
    corners = tube([(0, -0.2, 0), (0.05, 0.5, 0), (0.1, 1.8, 0.05), (0, TRUNK, 0), (0.1, CROWN + 1, 0.1)], [0.55, 0.36, 0.28, 0.24, 0.06], 10)
    ends = []
    for i in range(LIMBS):
        turn, high = 2.4 * i, TRUNK - 0.7 + 0.22 * i
        end = (0.8 * RADII[0] * math.cos(turn), CROWN + dice(-0.9, 1.1), 0.8 * RADII[2] * math.sin(turn))
        middle = (0.45 * end[0], 0.45 * high + 0.55 * end[1] - 0.1, 0.45 * end[2])
        corners += tube([(0, high, 0), middle, end], [0.14, 0.08, 0.02])
        ends += [middle, end, add(middle, end)]
    return corners, [tuple(x / 2 for x in e) if i % 3 == 2 else e for i, e in enumerate(ends)]


def foliage(ends):
    """Cards about the ends of limbs, within the crown; normals point out of it, so that the crown is lit as one."""
    corners = []
    while len(corners) < 6 * CARDS:
        end = ends[int(dice(0, len(ends)))]
        place = add(end, (dice(-1.2, 1.2), dice(-0.8, 1.0), dice(-1.2, 1.2)))
        out = tuple((p - c) / r for p, c, r in zip(place, (0, CROWN, 0), RADII))
        if sum(x * x for x in out) > 1.1:
            continue
        up = unit((dice(-1, 1), dice(-0.2, 1), dice(-1, 1)))
        u, v = across(up)
        turn, half = dice(0, 6.3), dice(0.5, 0.8)
        side = tuple(math.cos(turn) * x + math.sin(turn) * y for x, y in zip(u, v))
        normal = unit(add(out, (0.01, 0.2, 0)))
        at = [(add(add(place, side, half * x), up, half * y), normal, ((1 + x) / 2, (1 - y) / 2)) for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
        corners += [at[k] for k in (0, 1, 2, 0, 2, 3)]
    return corners


# ---- the file ------------------------------------------------------------------------------------

def write(path):
    data, views, accessors = b"", [], []

    def view(packed):
        nonlocal data
        views.append({"buffer": 0, "byteOffset": len(data), "byteLength": len(packed)})
        data += packed + b"\0" * (-len(packed) % 4)
        return len(views) - 1

    def primitive(corners, material):
        indices = []
        for part, kind in enumerate(("VEC3", "VEC3", "VEC2")):
            packed = b"".join(struct.pack("<%df" % len(c[part]), *c[part]) for c in corners)
            columns = list(zip(*(struct.iter_unpack("<%df" % len(corners[0][part]), packed))))
            accessors.append({"bufferView": view(packed), "componentType": 5126, "count": len(corners), "type": kind,
                              "min": [min(c) for c in columns], "max": [max(c) for c in columns]})
            indices.append(len(accessors) - 1)
        return {"primitives": [{"attributes": dict(zip(("POSITION", "NORMAL", "TEXCOORD_0"), indices)), "material": material}]}

    corners, ends = wood()
    meshes = [primitive(corners, 0), primitive(foliage(ends), 1)]
    gltf = {"asset": {"version": "2.0", "generator": "make_tree.py of nebel"}, "scene": 0, "scenes": [{"nodes": [0, 1]}],
            "nodes": [{"name": "Wood", "mesh": 0}, {"name": "Leaves", "mesh": 1}], "meshes": meshes,
            "materials": [{"name": "bark", "pbrMetallicRoughness": {"baseColorFactor": [0.10, 0.075, 0.055, 1], "metallicFactor": 0}},
                          {"name": "leaves", "alphaMode": "MASK", "alphaCutoff": 0.5, "doubleSided": True,
                           "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}, "metallicFactor": 0}}],
            "textures": [{"source": 0}], "images": [{"bufferView": view(picture()), "mimeType": "image/png"}],
            "accessors": accessors, "bufferViews": views, "buffers": [{"byteLength": len(data)}]}
    text = json.dumps(gltf, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    with open(path + ".part", "wb") as file:
        file.write(struct.pack("<4sII", b"glTF", 2, 28 + len(text) + len(data)))
        file.write(struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(data), b"BIN\0") + data)
    os.replace(path + ".part", path)


if __name__ == "__main__":
    write(sys.argv[1])
