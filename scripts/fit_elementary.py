#!/usr/bin/env python3
"""Derives the polynomial coefficients of src/formulas/elementary.inc and src/stream/stream_packet.h.

Each table is the weighted minimax polynomial found by the Remez exchange in 60-digit arithmetic: the polynomial p of
the given degree for which max |weight * (f - p)| over the interval is smallest. Deterministic; needs mpmath.

    fit_elementary.py                  print the tables with the error of each
    fit_elementary.py --check FILE...  exit 1 unless every coefficient stands in one of the files as printed
"""
import sys

from mpmath import mp, mpf, matrix, lu_solve, exp, expm1, log, erf, erfc, sqrt, pi, cos, polyval

mp.dps = 60


def solve_alternation(f, weight, nodes, degree):
    """The polynomial whose weighted error has the same size and alternating sign at degree + 2 nodes."""
    n = degree + 2
    a = matrix(n, n)
    b = matrix(n, 1)
    for i, x in enumerate(nodes):
        for j in range(degree + 1):
            a[i, j] = x ** j
        a[i, degree + 1] = (-1) ** i / weight(x)
        b[i] = f(x)
    solution = lu_solve(a, b)
    return [solution[j] for j in range(degree + 1)], abs(solution[degree + 1])


def largest_near(error, lo, hi):
    """Where |error| peaks between lo and hi, by golden section."""
    ratio = (sqrt(mpf(5)) - 1) / 2
    for _ in range(40):
        a, b = hi - ratio * (hi - lo), lo + ratio * (hi - lo)
        if abs(error(a)) > abs(error(b)):
            hi = b
        else:
            lo = a
    return (lo + hi) / 2


def extrema(error, lo, hi, degree):
    """One extremum of the error between each two of its sign changes, seen on a Chebyshev-spaced grid."""
    count = 24 * (degree + 2)
    grid = [(lo + hi) / 2 - (hi - lo) / 2 * cos(pi * i / count) for i in range(count + 1)]
    values = [error(x) for x in grid]
    groups = [[0]]
    for i in range(1, len(grid)):
        if values[i] * values[groups[-1][-1]] < 0:
            groups.append([])
        groups[-1].append(i)
    peaks = []
    for group in groups:
        best = max(group, key=lambda i: abs(values[i]))
        peaks.append(largest_near(error, grid[max(best - 1, 0)], grid[min(best + 1, count)]))
    while len(peaks) > degree + 2:
        peaks.pop(0 if abs(error(peaks[0])) < abs(error(peaks[-1])) else -1)
    return peaks


def remez(f, weight, lo, hi, degree):
    """Coefficients, lowest power first, and the weighted error."""
    lo, hi = mpf(lo), mpf(hi)
    n = degree + 2
    nodes = [(lo + hi) / 2 - (hi - lo) / 2 * cos(pi * (2 * i + 1) / (2 * n)) for i in range(n)]
    for _ in range(12):
        coefficients, level = solve_alternation(f, weight, nodes, degree)
        backwards = coefficients[::-1]

        def error(x):
            return weight(x) * (f(x) - polyval(backwards, x))

        nodes = extrema(error, lo, hi, degree)
        if len(nodes) < n:
            raise ArithmeticError("the error does not alternate often enough")
        worst = max(abs(error(x)) for x in nodes)
        if worst < level * mpf("1.0001"):
            break
    return coefficients, worst


def fill(x, hole, value, function):
    """function(x), and its limit at the removable singularity."""
    return value if x == hole else function(x)


def exp_tail(r):
    """(e^r - 1 - r - r^2/2) / r^3, by its series: the closed form cancels."""
    term, total, n = mpf(1) / 6, mpf(0), 3
    while abs(term) > mpf(10) ** -70:
        total += term
        n += 1
        term *= r / n
    return total


def log_tail(z):
    """(log((1 + s) / (1 - s)) / s - 2) / s^2 with z = s^2."""
    return sum(2 * z ** k / (2 * k + 3) for k in range(60))


def erf_tail(z):
    """erf(x) / x - 1 with z = x^2."""
    return fill(z, 0, 2 / sqrt(pi) - 1, lambda z: erf(sqrt(z)) / sqrt(z) - 1)


ERFCX_POLE = 2


def erfcx(x):
    """e^(x^2) erfc(x); the asymptotic series where the product would overflow."""
    if x < 30:
        return exp(x * x) * erfc(x)
    term, total, n = mpf(1), mpf(0), 0
    while abs(term) > mpf(10) ** -50 and n < 200:
        total += term
        n += 1
        term *= -(2 * n - 1) / (2 * x * x)
    return total / (x * sqrt(pi))


def erfcx_mapped(t):
    """(x + K) erfcx(x) with x = K (1 + t) / (1 - t)."""
    if t > 1 - mpf(10) ** -25:
        return 1 / sqrt(pi)
    x = ERFCX_POLE * (1 + t) / (1 - t)
    return (x + ERFCX_POLE) * erfcx(x)


def exp2_tail(f):
    """(2^f - 1) / f."""
    return fill(f, 0, log(mpf(2)), lambda f: expm1(f * log(mpf(2))) / f)


HALF_LN2 = log(mpf(2)) / 2 * mpf("1.001")
LOG_Z = ((sqrt(mpf(2)) - 1) / (sqrt(mpf(2)) + 1)) ** 2 * mpf("1.001")

TABLES = [
    # name, function, weight (so that the error is that of the final function, relative), interval, degrees in float and double (None: not used)
    ("exp: (e^r - 1 - r - r^2/2) / r^3", exp_tail, lambda r: abs(r) ** 3 + mpf(10) ** -9, (-HALF_LN2, HALF_LN2), 3, 8),
    ("log: (log((1+s)/(1-s))/s - 2) / s^2 in s^2", log_tail, lambda z: z / 2 + mpf(10) ** -9, (0, LOG_Z), 2, 6),
    ("erf: erf(x)/x - 1 in x^2", erf_tail, lambda z: 1 / (1 + erf_tail(z)), (0, mpf("1.001")), 6, 11),
    ("erfcx: (x + 2) erfcx(x) in t = (x - 2)/(x + 2)", erfcx_mapped, lambda t: 1 / erfcx_mapped(t), (-1, 1), 11, 26),
    ("octaves: (2^f - 1) / f", exp2_tail, lambda f: abs(f) / 2 ** f + mpf(10) ** -9, (mpf("-0.5005"), mpf("0.5005")), 4, None),
]

CONSTANTS = [
    ("1 / ln 2", 1 / log(mpf(2))),
    ("2 / sqrt(pi)", 2 / sqrt(pi)),
    ("sqrt(pi) / 2", sqrt(pi) / 2),
]


def digits(value, count):
    text = mp.nstr(value, count, min_fixed=-mp.inf if abs(value) > mpf("1e-4") else 0, max_fixed=mp.inf)
    return text if "." in text else text.replace("e", ".0e")


def literals():
    """(heading, [literal, ...]) for every table, float then double."""
    for name, f, weight, (lo, hi), single, double in TABLES:
        for kind, degree, count in (("float", single, 9), ("double", double, 17)):
            if degree is None:
                continue
            coefficients, worst = remez(f, weight, lo, hi, degree)
            heading = "%s, %s, degree %d, weighted error %s" % (name, kind, degree, mp.nstr(worst, 3))
            yield heading, ["NB_F(%s)" % digits(c, count) for c in coefficients]
    yield "constants", ["%s: %s" % (name, digits(value, 25)) for name, value in CONSTANTS]


def main(arguments):
    text = "".join(open(path).read() for path in arguments[1:]) if arguments[:1] == ["--check"] else None
    missing = 0
    for heading, values in literals():
        print(heading)
        for value in values:
            lost = text is not None and heading != "constants" and value not in text
            missing += lost
            print("   ", value, "MISSING" if lost else "")
    return 1 if missing else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
