#!/usr/bin/env python3
"""Draws the response curves of nebel/classic.h as the library computes them.

    scripts/plot_curves.py build/libnebel.so >docs/pictures/curves.svg
"""

import ctypes
import sys

WIDTH, HEIGHT, LEFT, BOTTOM, TOP, RIGHT = 560, 300, 46, 40, 16, 16
FARTHEST = 40  # m
GRID = "#ccc"


class Curve(ctypes.Structure):
    _fields_ = [("type", ctypes.c_int), ("k", ctypes.c_double), ("table", ctypes.POINTER(ctypes.c_float))]


def curves():
    """(name, colour, at which length and on which side the name stands, curve), with their defaults and a table of steps."""
    steps = (ctypes.c_float * 256)(*[min(1, .25 * (1 + i // 51)) for i in range(256)])
    return [("0.05 s", "#1565c0", 15, -1, Curve(1, .05, None)), ("exp(0.03 s) - 1", "#c62828", 20, 1, Curve(2, .03, None)),
            ("exp((0.04 s)^2) - 1", "#2e7d32", 14, 1, Curve(3, .04, None)), ("a table", "#999", 5, 1, Curve(4, .05, steps)),
            ("1 - exp(-0.05 s)", "#333", 33, 1, Curve(0, .05, None))]


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    weigh = ctypes.CDLL(sys.argv[1]).nebel_compute_curve_weight
    weigh.argtypes, weigh.restype = [ctypes.POINTER(Curve), ctypes.c_double], ctypes.c_double

    def x(s):
        return LEFT + (WIDTH - LEFT - RIGHT) * s / FARTHEST

    def y(weight):
        return HEIGHT - BOTTOM - (HEIGHT - BOTTOM - TOP) * weight

    def text(at_x, at_y, words, anchor, color="#333"):
        return f'<text x="{at_x:.0f}" y="{at_y:.0f}" text-anchor="{anchor}" fill="{color}">{words}</text>'

    out = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" font-family="sans-serif" font-size="12">',
           f'<rect width="{WIDTH}" height="{HEIGHT}" fill="#fff"/>']
    for i in range(5):
        out += [f'<path d="M{LEFT} {y(i / 4):.1f}H{WIDTH - RIGHT}M{x(10 * i):.1f} {TOP}V{HEIGHT - BOTTOM}" stroke="{GRID}"/>',
                text(LEFT - 6, y(i / 4) + 4, f"{i / 4:g}", "end"), text(x(10 * i), HEIGHT - BOTTOM + 16, f"{10 * i} m", "middle")]
    for name, color, place, side, curve in curves():
        points = [(s / 4, weigh(curve, s / 4)) for s in range(4 * FARTHEST + 1)]
        line = "L".join(f"{x(s):.1f} {y(weight):.1f}" for s, weight in points)
        out += [f'<path d="M{line}" fill="none" stroke="{color}" stroke-width="2"/>',
                text(x(place) + side * 6, y(weigh(curve, place)) + 4 + side * 10, name, "start" if side > 0 else "end", color)]
    out += [text((LEFT + WIDTH) / 2, HEIGHT - 6, "length in fog", "middle"), "</svg>"]
    print("\n".join(out))


if __name__ == "__main__":
    main()
