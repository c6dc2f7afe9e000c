#!/usr/bin/env python3
"""make_landscape.py OUT.png: the height map of the morning mist scene, 601 x 601 points in 16 bit.

Hills of fractal value noise around a winding valley; no dependencies, the same bytes everywhere.
"""
import math
import os
import struct
import sys
import zlib

SIZE = 601
HILLS = 7.0  # feature size of the first octave: this many across the map


def lattice(ix, iz, octave):
    """A repeatable pseudo-random number in 0..1 at a lattice point."""
    h = (ix * 374761393 + iz * 668265263 + octave * 2147483629) & 0xFFFFFFFF
    h = ((h ^ (h >> 13)) * 1274126177) & 0xFFFFFFFF
    h = ((h ^ (h >> 15)) * 2246822519) & 0xFFFFFFFF
    return ((h ^ (h >> 16)) & 0xFFFF) / 65535.0


def octave_rows(octave, frequency):
    """One octave of value noise over the whole map, row by row, with quintic interpolation."""
    cells = int(frequency) + 2
    grid = [[lattice(i, j, octave) for i in range(cells + 1)] for j in range(cells + 1)]
    steps = []
    for i in range(SIZE):
        x = i * frequency / (SIZE - 1)
        cell = int(x)
        t = x - cell
        steps.append((cell, t * t * t * (t * (t * 6 - 15) + 10)))
    for cell_z, t_z in steps:
        low, high = grid[cell_z], grid[cell_z + 1]
        line = [a + (b - a) * t_z for a, b in zip(low, high)]
        yield [line[c] + (line[c + 1] - line[c]) * t for c, t in steps]


def valley(i, j):
    """0 on the floor of a winding valley, 1 on the heights beside it."""
    x, z = i / (SIZE - 1), j / (SIZE - 1)
    middle = 0.5 + 0.10 * math.sin(5.2 * z + 0.6) + 0.035 * math.sin(13.0 * z + 2.0)
    distance = abs(x - middle)
    t = min(1.0, max(0.0, (distance - 0.02) / 0.30))
    return t * t * (3 - 2 * t)


def heights():
    rows = [[0.0] * SIZE for _ in range(SIZE)]
    amplitude, total = 1.0, 0.0
    for octave in range(7):
        for row, noise in zip(rows, octave_rows(octave, HILLS * 2**octave)):
            if octave in (1, 2):  # ridges
                row[:] = [h + amplitude * (1 - abs(2 * n - 1)) for h, n in zip(row, noise)]
            else:
                row[:] = [h + amplitude * n for h, n in zip(row, noise)]
        total += amplitude
        amplitude *= 0.46
    for j, row in enumerate(rows):
        for i in range(SIZE):
            v = valley(i, j)
            row[i] = (row[i] / total) * (0.16 + 0.84 * v) + 0.22 * v
    low = min(min(row) for row in rows)
    high = max(max(row) for row in rows)
    return [[(h - low) / (high - low) for h in row] for row in rows]


def chunk(name, data):
    return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))


def write_png(path, rows):
    raw = b"".join(b"\0" + struct.pack(f">{SIZE}H", *(round(65535 * h) for h in row)) for row in rows)
    header = struct.pack(">IIBBBBB", SIZE, SIZE, 16, 0, 0, 0, 0)
    part = f"{path}.{os.getpid()}.tmp"  # nobody shall see half of it
    with open(part, "wb") as out:
        out.write(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(raw, 6)) + chunk(b"IEND", b""))
    os.replace(part, path)


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit("usage: make_landscape.py OUT.png")
    write_png(sys.argv[1], heights())
