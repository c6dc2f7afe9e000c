#!/usr/bin/env python3
"""Compares `nebel trace` with numbers that were integrated by brute force, in double and with every instruction set.

Each file of tests/truth but physics.json holds a scene, rays and, for every ray, T and S of three channels and how far
these may be off themselves. What must hold, L being max(1, the largest source radiance of the scene):

    double   |T - truth| <= 1e-10 + own                    |S - truth| <= tolerance L + 1e-9 + own
    float    |T - truth| <= tolerance + 2e-5 + own         |S - truth| <= tolerance L + 2e-5 + own
    error    >= the largest of the six differences - own, and <= tolerance L + 1e-8 (double), + 1e-4 (float; of a
             thousand rays one may be above)
    all instruction sets give the same bytes

To own comes the rounding of a sum of 50,000 doubles, 1e-13; with a sun 2e-6, since its own differences were of two
neighbouring numbers of pieces, which the roots at silhouettes make alike.
"""

import json
import os
import pathlib
import subprocess
import sys
import tempfile

NEBEL = os.environ["NEBEL"]
TRUTH = pathlib.Path(__file__).resolve().parent / "truth"
TOLERANCES = (1e-7, 0.002)
SUN_TOLERANCES = (1e-5, 0.001)
SUN_OWN = 2e-6
ROUNDING = 1e-13
HEADER = "T_r,T_g,T_b,S_r,S_g,S_b,error"


def instruction_sets():
    listing = subprocess.run([NEBEL, "info"], check=True, capture_output=True, text=True).stdout
    line = next(line for line in listing.splitlines() if line.startswith("instruction sets:"))
    return line.split(":")[1].split()


def trace(scene, rays, *options):
    text = "".join(" ".join(map(repr, ray)) + "\n" for ray in rays)
    done = subprocess.run([NEBEL, "trace", scene, *options], input=text, capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(f"check_truth: nebel trace {scene} {' '.join(options)}: status {done.returncode}\n{done.stderr}")
    return done.stdout


def numbers_of(output):
    lines = output.splitlines()
    assert lines[0] == HEADER, lines[0]
    return [[float(field) for field in line.split(",")] for line in lines[1:]]


def largest(value):
    return max(value) if isinstance(value, list) else value


def largest_source(scene):
    """max(1, largest source radiance), that of lit volumes included."""
    ambient = scene.get("ambient", 0)
    lit = [largest(volume.get("albedo", 0)) * largest(ambient) for volume in scene["fog"]]
    return max([1] + lit + [largest(volume.get("source", 0)) for volume in scene["fog"]])


class Report:
    def __init__(self):
        self.checks = 0
        self.faults = []

    def check(self, good, text):
        self.checks += 1
        if not good:
            self.faults.append(text)


def judge(report, name, truth, results, tolerance, is_float):
    """Worst differences of T and S, what is beyond the bounds of the file's opening going to the report."""
    reach = tolerance * largest_source(truth["scene"])
    worst_t = worst_s = 0
    loose = 0
    report.check(len(results) == len(truth["expected"]), f"{name}: {len(results)} results for {len(truth['expected'])} rays")
    for number, (expected, result) in enumerate(zip(truth["expected"], results)):
        own = expected[6] + (SUN_OWN if "sun" in truth["scene"] else ROUNDING)
        apart = [abs(a - b) for a, b in zip(expected[:6], result[:6])]
        t, s = max(apart[:3]), max(apart[3:])
        worst_t, worst_s = max(worst_t, t), max(worst_s, s)
        place = f"{name}: ray {number + 1}"
        t_bound = tolerance + 2e-5 if is_float else 1e-10
        s_bound = reach + (2e-5 if is_float else 1e-9)
        report.check(t <= t_bound + own, f"{place}: T is {t:.3g} off, {t_bound:.3g} + {own:.3g} is allowed")
        report.check(s <= s_bound + own, f"{place}: S is {s:.3g} off, {s_bound:.3g} + {own:.3g} is allowed")
        report.check(result[6] >= max(t, s) - own, f"{place}: error {result[6]:.3g} is less than the real {max(t, s):.3g}")
        if result[6] > reach + (1e-4 if is_float else 1e-8):
            loose += 1
            if not is_float:
                report.check(False, f"{place}: error {result[6]:.3g} is more than {reach + 1e-8:.3g}")
    return worst_t, worst_s, loose


def check_file(report, path, folder, isas):
    truth = json.loads(path.read_text())
    scene = os.path.join(folder, path.name)
    pathlib.Path(scene).write_text(json.dumps(truth["scene"]))
    loose = count = 0
    for tolerance in SUN_TOLERANCES if "sun" in truth["scene"] else TOLERANCES:
        options = ["--tolerance", repr(tolerance)]
        worst = judge(report, f"{path.name} double {tolerance:g}", truth,
                      numbers_of(trace(scene, truth["rays"], *options)), tolerance, False)
        print(f"{path.name:16} double {tolerance:<6g} T {worst[0]:.2e}  S {worst[1]:.2e}")
        outputs = [trace(scene, truth["rays"], *options, "--precision", "float", "--isa", isa) for isa in isas]
        for isa, output in zip(isas, outputs):
            report.check(output == outputs[0], f"{path.name} float {tolerance:g}: {isa} and {isas[0]} differ")
        worst = judge(report, f"{path.name} float {tolerance:g}", truth, numbers_of(outputs[0]), tolerance, True)
        print(f"{path.name:16} float  {tolerance:<6g} T {worst[0]:.2e}  S {worst[1]:.2e}")
        loose += worst[2]
        count += len(truth["rays"])
    return loose, count


def main():
    paths = sorted(path for path in TRUTH.glob("*.json") if path.name != "physics.json")
    if not paths:
        sys.exit(f"check_truth: no files in {TRUTH}")
    isas = instruction_sets()
    report = Report()
    loose = count = 0
    with tempfile.TemporaryDirectory() as folder:
        for path in paths:
            found = check_file(report, path, folder, isas)
            loose += found[0]
            count += found[1]
    report.check(loose * 1000 <= count, f"float: error is loose on {loose} of {count} rays, 1 in 1000 is allowed")
    print("\n".join(report.faults))
    print(f"check_truth: {report.checks} checks with {' '.join(isas)}, {len(report.faults)} faults")
    return 1 if report.faults else 0


if __name__ == "__main__":
    sys.exit(main())
