#!/usr/bin/env python3
"""Compares lit fog with brute force over very many rays: test_lit_truth with other seeds in several processes, and the sum of its
tables.

check_lit_truth.py BUILD [--rays N] [--seed N] [--jobs N]

A million rays take 20 minutes on two cores. The same seed gives the same rays. Exits 1 where an error was too small, where a ray had
other bits, or where the oracle often did not agree with itself."""

import argparse
import collections
import concurrent.futures
import os
import re
import subprocess
import sys

EACH = 3480  # rays of a process: ten seeds of 18 kinds of fog and two kinds of light, with ten rays each, four of crowds
ROW = re.compile(r"^(\w[\w ]*?) +(sun|lights)((?: +[\d.]+){11})$")


def run(program, seed, rays):
    done = subprocess.run([program, "test_lit_truth", str(seed), str(rays)], capture_output=True, text=True)
    return seed, done.returncode, done.stdout + done.stderr


def add(table, text):
    for line in text.splitlines():
        row = ROW.match(line)
        if not row:
            continue
        numbers = [float(word) for word in row[3].split()]
        sums = table.setdefault((row[1], row[2]), [0.0] * len(numbers))
        for i, number in enumerate(numbers):
            is_worst = i < 9 and i % 3 == 2
            sums[i] = max(sums[i], number) if is_worst else sums[i] + number


def print_table(table):
    ways = ["double", "double, 1e-5", "float"]
    print(f"{'fog':12} {'light':6} " + " ".join(f"{way:>22}" for way in ways) + f" {'float again':>22}")
    print(f"{'':19} " + " ".join(f"{'rays':>9} {'bad':>6} {'worst':>5}" for _ in ways) + f" {'rays':>11} {'other bits':>10}")
    for (fog, light), sums in table.items():
        cells = " ".join(f"{sums[i]:9.0f} {sums[i + 1]:6.0f} {sums[i + 2]:5.2f}" for i in (0, 3, 6))
        print(f"{fog:12} {light:6}  {cells} {sums[9]:11.0f} {sums[10]:10.0f}")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("build")
    parser.add_argument("--rays", type=int, default=1000000)
    parser.add_argument("--seed", type=int, default=10000000)
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    options = parser.parse_args()
    program = os.path.join(options.build, "tests", "nebel_test_core")
    count = max(1, -(-options.rays // EACH))
    table, sums, failed = {}, collections.Counter(), 0
    with concurrent.futures.ThreadPoolExecutor(options.jobs) as pool:
        runs = [pool.submit(run, program, options.seed + 10 * i, EACH) for i in range(count)]
        for done in concurrent.futures.as_completed(runs):
            seed, status, text = done.result()
            add(table, text)
            for name, number in re.findall(r"(rays|undecided|errors too small|other bits) (\d+)(?=[,\n])", text):
                sums[name] += int(number)
            twice = re.search(r"looked twice at (\d+) rays: (\d+) not the same", text)
            if twice:
                sums["looked at twice"] += int(twice[1])
                sums["not the same"] += int(twice[2])
            if status != 0:
                failed += 1
                print(f"check_lit_truth: seeds {seed} to {seed + 9}:\n{text}", file=sys.stderr)
    print_table(table)
    print(", ".join(f"{name} {number}" for name, number in sums.items()) +
          f"; seeds {options.seed} to {options.seed + 10 * count - 1}, {failed} of {count} runs failed")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
