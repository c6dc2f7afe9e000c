#!/usr/bin/env python3
"""Draws what more volumes cost at the same coverage, from the figures of nebel bench --device gl --json.

    scripts/plot_growth.py figures.json >docs/pictures/growth.svg
"""

import json
import math
import re
import sys

WIDTH, HEIGHT, LEFT, BOTTOM, TOP, RIGHT = 560, 300, 60, 40, 16, 30
GRID, LINE, FAINT = "#ccc", "#1565c0", "#999"


def points_of(path):
    """(volumes, times the first) of the cases whose coverage is the same."""
    cases = []
    for figure in json.load(open(path, encoding="utf-8"))["figures"]:
        match = re.fullmatch(r"(\d+) balls, [\d.]+ a pixel", figure["name"])
        if match:
            cases.append((int(match[1]), figure["value"]))
    if len(cases) < 2:
        sys.exit(f"{path}: no figures of nebel bench --device gl")
    return [(count, value / cases[0][1]) for count, value in cases]


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    points = points_of(sys.argv[1])
    decades = math.log10(points[-1][0] / points[0][0])

    def x(count):
        return LEFT + (WIDTH - LEFT - RIGHT) * math.log10(count / points[0][0]) / decades

    def y(times):
        return HEIGHT - BOTTOM - (HEIGHT - BOTTOM - TOP) * math.log10(times) / decades

    def text(at_x, at_y, words, anchor, color="#333"):
        return f'<text x="{at_x:.0f}" y="{at_y:.0f}" text-anchor="{anchor}" fill="{color}">{words}</text>'

    out = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" font-family="sans-serif" font-size="12">',
           f'<rect width="{WIDTH}" height="{HEIGHT}" fill="#fff"/>']
    for power in range(int(decades) + 1):
        times, count = 10 ** power, points[0][0] * 10 ** power
        out += [f'<path d="M{LEFT} {y(times):.1f}H{WIDTH - RIGHT}M{x(count):.1f} {TOP}V{HEIGHT - BOTTOM}" stroke="{GRID}"/>',
                text(LEFT - 6, y(times) + 4, f"{times} x", "end"), text(x(count), HEIGHT - BOTTOM + 16, f"{count:,}", "middle")]
    out += [f'<path d="M{x(points[0][0]):.1f} {y(1):.1f}L{x(points[-1][0]):.1f} {y(10 ** decades):.1f}" '
            f'stroke="{FAINT}" stroke-dasharray="4 4"/>',
            text(x(points[0][0] * 10 ** (decades / 2)) - 8, y(10 ** (decades / 2)) - 6, "in proportion", "end", FAINT),
            f'<path d="M{"L".join(f"{x(count):.1f} {y(times):.1f}" for count, times in points)}" fill="none" stroke="{LINE}" '
            'stroke-width="2"/>']
    for count, times in points:
        out += [f'<circle cx="{x(count):.1f}" cy="{y(times):.1f}" r="4" fill="{LINE}"/>',
                text(x(count), y(times) - 10, f"{times:.1f} x", "end" if count == points[-1][0] else "start", LINE)]
    out += [text((LEFT + WIDTH) / 2, HEIGHT - 6, "volumes, of the same coverage", "middle"), "</svg>"]
    print("\n".join(out))


if __name__ == "__main__":
    main()
