#!/usr/bin/env python3
"""Makes the table of phase functions of cloud droplets, src/clouds/cloud_phase_table.c, by Mie's theory.

    make_droplets.py FILE      write it (some minutes; needs NumPy)

Spheres of water: the sums of Bohren and Huffman, Absorption and Scattering of Light by Small Particles, 1983, chapter 4, with
the logarithmic derivative by downward and the functions of Riccati and Bessel by upward recurrence, up to the order
x + 4 x^(1/3) + 2 (Wiscombe, Improved Mie Scattering Algorithms, 1980). Sizes: the gamma distribution of Hansen and Travis,
Light Scattering in Planetary Atmospheres, 1974, with an effective variance of 0.1. Refractive indices: Hale and Querry, Optical
Constants of Water, 1973, linear between their wavelengths.
"""
import sys

import numpy as np

WAVELENGTHS = (0.680, 0.550, 0.440)  # micrometers, of red, green and blue as in the presets of air
INDICES = (1.331 + 2.45e-8j, 1.333 + 1.96e-9j, 1.3374 + 1.13e-9j)
VARIANCE = 0.1
DIAMETERS = 4 * 12.5 ** (np.arange(12) / 11)  # micrometers
ANGLES = 224
SCALE = 2048

# Radii end at four times the effective one; neighbors are so far apart, in size parameters, that narrow resonances are met.
LARGEST = 4
FIRST_STEP, STEP_GROWTH = 0.003, 5e-5


def coefficients(x, m):
    """a and b by radius and order, 0 beyond the last order of each radius."""
    last = (x + 4 * np.cbrt(x) + 2).astype(int)
    most = last.max()
    y = m * x
    log_derivative = np.zeros_like(y)
    kept = np.zeros((most + 1, len(x)), complex)
    for n in range(int(abs(y).max()) + 20, 0, -1):
        log_derivative = n / y - 1 / (log_derivative + n / y)
        if n - 1 <= most:
            kept[n - 1] = log_derivative
    before, psi = np.cos(x), np.sin(x)
    chi_before, chi = -np.sin(x), np.cos(x)
    a = np.zeros((len(x), most), complex)
    b = np.zeros((len(x), most), complex)
    for n in range(1, most + 1):
        with np.errstate(all="ignore"):
            next_psi = (2 * n - 1) * psi / x - before
            next_chi = (2 * n - 1) * chi / x - chi_before
            xi, next_xi = psi - 1j * chi, next_psi - 1j * next_chi
            electric, magnetic = kept[n] / m + n / x, m * kept[n] + n / x
            a[:, n - 1] = np.where(n <= last, (electric * next_psi - psi) / (electric * next_xi - xi), 0)
            b[:, n - 1] = np.where(n <= last, (magnetic * next_psi - psi) / (magnetic * next_xi - xi), 0)
        before, psi, chi_before, chi = psi, next_psi, chi, next_chi
    return a, b


def angular_functions(cosines, most):
    pi, tau = np.zeros((most, len(cosines))), np.zeros((most, len(cosines)))
    before, value = np.zeros_like(cosines), np.ones_like(cosines)
    for n in range(1, most + 1):
        pi[n - 1] = value
        tau[n - 1] = n * cosines * value - (n + 1) * before
        before, value = value, ((2 * n + 1) * cosines * value - (n + 1) * before) / n
    return pi, tau


def scatter(x, m, cosines):
    """What spheres scatter of unpolarized light, by radius and angle, and in all; in units of 1 / wave number^2."""
    a, b = coefficients(x, m)
    n = np.arange(1, a.shape[1] + 1)
    pi, tau = angular_functions(cosines, a.shape[1])
    whole = 2 * np.pi * ((2 * n + 1) * (abs(a) ** 2 + abs(b) ** 2)).sum(1)
    weight = (2 * n + 1) / (n * (n + 1))
    a, b = a * weight, b * weight
    return (abs(a @ pi + b @ tau) ** 2 + abs(a @ tau + b @ pi) ** 2) / 2, whole


def sizes(most):
    x = [0.5]
    while x[-1] < most:
        x.append(x[-1] + FIRST_STEP + STEP_GROWTH * x[-1])
    return np.array(x)


def phase_functions(color, diameters, cosines):
    """1/sr, by diameter and angle."""
    wave = 2 * np.pi / WAVELENGTHS[color]
    x = sizes(LARGEST * wave * max(diameters) / 2)
    steps = np.gradient(x)
    light, whole = np.zeros((len(diameters), len(cosines))), np.zeros(len(diameters))
    for first in range(0, len(x), 512):
        piece = x[first : first + 512]
        each, all_of_it = scatter(piece, INDICES[color], cosines)
        for i, diameter in enumerate(diameters):
            radius = piece / (wave * diameter / 2)
            number = np.exp((1 - 3 * VARIANCE) / VARIANCE * np.log(radius) - (radius - 1) / VARIANCE)
            light[i] += (number * steps[first : first + 512]) @ each
            whole[i] += (number * steps[first : first + 512]) @ all_of_it
    return light / whole[:, None]


def place_of(angle):
    """As place_of of src/clouds/cloud_phase.c: 0 straight ahead, 1 straight back."""
    ahead, back = np.sin(angle / 2), np.cos(angle / 2)
    return 0.2 * 1.02 * ahead / (ahead + 0.02) + 0.15 * (1 - 1.03 * back / (back + 0.03)) + 0.65 * (1 - back)


def angles():
    low, high = np.zeros(ANGLES), np.full(ANGLES, np.pi)
    for _ in range(60):
        middle = (low + high) / 2
        is_before = place_of(middle) < np.arange(ANGLES) / (ANGLES - 1)
        low, high = np.where(is_before, middle, low), np.where(is_before, high, middle)
    middle = (low + high) / 2
    middle[0], middle[-1] = 0, np.pi
    return middle


def write(file):
    cosines = np.cos(angles())
    file.write('/* Written by scripts/make_droplets.py, which says of what. */\n#include "cloud_phase.h"\n\n/* clang-format off */\n')
    file.write("const int16_t nb_cloud_phase_table[3][NB_CLOUD_PHASE_DIAMETERS][NB_CLOUD_PHASE_ANGLES] = {\n")
    for color in range(3):
        file.write("{\n")
        for values in phase_functions(color, DIAMETERS, cosines):
            numbers = np.rint(SCALE * np.log(values)).astype(int)
            lines = [",".join(map(str, numbers[i : i + 17])) for i in range(0, ANGLES, 17)]
            file.write("{" + ",\n".join(lines) + "},\n")
        file.write("},\n")
    file.write("};\n")


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    with open(sys.argv[1], "w", encoding="utf-8") as out:
        write(out)
