#!/usr/bin/env python3
"""make_planet.py OUT.obj: the planet of the nebula scene, a sphere of radius 1 with its material and its map of banded clouds beside it
(OUT.mtl, OUT.png).

No dependencies, the same bytes everywhere.
"""
import math
import os
import struct
import sys
import zlib

COLUMNS, ROWS = 128, 64  # of the sphere's faces
WIDTH, HEIGHT = 512, 256  # of the map, texels
BANDS = [(0.00, (0.30, 0.28, 0.33)), (0.14, (0.44, 0.36, 0.33)), (0.26, (0.66, 0.52, 0.40)), (0.36, (0.42, 0.30, 0.24)),
         (0.46, (0.82, 0.70, 0.55)), (0.54, (0.70, 0.55, 0.42)), (0.62, (0.46, 0.31, 0.25)), (0.74, (0.74, 0.62, 0.50)),
         (0.86, (0.45, 0.39, 0.38)), (1.00, (0.30, 0.29, 0.35))]


def lattice(ix, iy, iz):
    h = (ix * 374761393 + iy * 668265263 + iz * 2147483629) & 0xFFFFFFFF
    h = ((h ^ (h >> 13)) * 1274126177) & 0xFFFFFFFF
    h = ((h ^ (h >> 15)) * 2246822519) & 0xFFFFFFFF
    return ((h ^ (h >> 16)) & 0xFFFF) / 32767.5 - 1


def noise(x, y, z):
    """Value noise within -1 and 1, smooth; of three coordinates, so that the map has no seam and no poles."""
    ix, iy, iz = math.floor(x), math.floor(y), math.floor(z)
    fx, fy, fz = x - ix, y - iy, z - iz
    fx, fy, fz = (t * t * (3 - 2 * t) for t in (fx, fy, fz))
    total = 0.0
    for k in range(8):
        dx, dy, dz = k & 1, k >> 1 & 1, k >> 2
        share = (fx if dx else 1 - fx) * (fy if dy else 1 - fy) * (fz if dz else 1 - fz)
        total += share * lattice(ix + dx, iy + dy, iz + dz)
    return total


def band(latitude):
    """The colour of a band, 0 at one pole and 1 at the other."""
    for (low, below), (high, above) in zip(BANDS, BANDS[1:]):
        if latitude <= high:
            t = (latitude - low) / (high - low)
            t = t * t * (3 - 2 * t)
            return [a + (b - a) * t for a, b in zip(below, above)]
    return BANDS[-1][1]


def texel(x, y, z):
    """Winds drag the bands along: noise that is long in the direction of the wind bends their borders."""
    slow = noise(2 * x, 9 * y, 2 * z)
    quick = noise(5 * x + 3 * slow, 26 * y, 5 * z) + 0.5 * noise(11 * x, 50 * y + 2 * slow, 11 * z)
    latitude = 0.5 - math.asin(max(-1.0, min(1.0, y))) / math.pi
    color = band(min(1.0, max(0.0, latitude + 0.022 * slow + 0.016 * quick)))
    light = 1 + 0.10 * quick
    return [min(255, max(0, round(255 * c * light))) for c in color]


def write_map(path):
    raw = bytearray()
    for j in range(HEIGHT):
        theta = math.pi * (j + 0.5) / HEIGHT
        raw.append(0)
        for i in range(WIDTH):
            phi = 2 * math.pi * (i + 0.5) / WIDTH
            raw += bytes(texel(math.sin(theta) * math.cos(phi), math.cos(theta), math.sin(theta) * math.sin(phi)))
    header = struct.pack(">IIBBBBB", WIDTH, HEIGHT, 8, 2, 0, 0, 0)
    replace(path, b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(bytes(raw), 6)) + chunk(b"IEND", b""))


def chunk(name, data):
    return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))


def sphere(material):
    lines = [f"mtllib {material}", "usemtl planet"]
    for j in range(ROWS + 1):
        theta = math.pi * j / ROWS
        for i in range(COLUMNS + 1):
            phi = 2 * math.pi * i / COLUMNS
            n = f"{math.sin(theta) * math.cos(phi):.7f} {math.cos(theta):.7f} {math.sin(theta) * math.sin(phi):.7f}"
            lines += [f"v {n}", f"vn {n}", f"vt {i / COLUMNS:.7f} {1 - j / ROWS:.7f}"]
    for j in range(ROWS):
        for i in range(COLUMNS):
            a = j * (COLUMNS + 1) + i + 1
            b = a + COLUMNS + 1
            corners = [a, a + 1, b + 1, b]
            if j == 0:
                corners.remove(a + 1)
            if j == ROWS - 1:
                corners.remove(b)
            lines.append("f " + " ".join(f"{k}/{k}/{k}" for k in corners))
    return "\n".join(lines) + "\n"


def replace(path, data):
    part = f"{path}.{os.getpid()}.tmp"  # nobody shall see half of it
    with open(part, "wb") as out:
        out.write(data)
    os.replace(part, path)


if __name__ == "__main__":
    if len(sys.argv) != 2 or not sys.argv[1].endswith(".obj"):
        sys.exit("usage: make_planet.py OUT.obj")
    stem = sys.argv[1][:-4]
    name = os.path.basename(stem)
    write_map(stem + ".png")
    replace(stem + ".mtl", f"newmtl planet\nKd 1 1 1\nmap_Kd {name}.png\n".encode())
    replace(stem + ".obj", sphere(name + ".mtl").encode())
