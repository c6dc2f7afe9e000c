#!/usr/bin/env python3
"""check_faults.py BUILD [NUMBER...]: are the deliberate faults of scripts/faults.txt found by `make test`?

Copies the sources to BUILD/faults and builds them there, in BUILD/faults/build. Then applies one fault at a time, or only those with
the given numbers: builds what changed, runs what `make test` runs until a test fails, and undoes the fault. The suites that the list
expects to find a fault run first, and only what they need is built for them; if they pass, all others run. Prints a table and exits 1
if a fault is not found. A suite that fails without any fault finds nothing: the suites of the table run once more at the end.

An entry of the list: a line with the number, the file, what kind of fault it is and a regular expression of the suites that should
find it; then lines of the file behind `- `, which must occur in it exactly once, and what replaces them behind `+ `.
"""

import collections
import json
import os
import pathlib
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
SCALE = "0.1"
FAILED = re.compile(r"Test +#\d+: (\S+) .*\*\*\*(?!Not Run)")

Fault = collections.namedtuple("Fault", "number file kind suites right wrong")


def read_faults():
    faults = []
    for block in re.split(r"\n\s*\n", (ROOT / "scripts/faults.txt").read_text()):
        lines = [line for line in block.splitlines() if not line.startswith("#")]
        if not lines:
            continue
        number, file, kind, suites = lines[0].split()
        right, wrong = ("\n".join(line[2:] for line in lines[1:] if line[0] == sign) for sign in "-+")
        faults.append(Fault(int(number), file, kind, suites, right, wrong))
    return faults


def check_list(faults):
    """Errors of the list itself."""
    if [fault.number for fault in faults] != list(range(1, len(faults) + 1)):
        yield "faults.txt: number the faults from 1 on, in order"
    for fault in faults:
        path = ROOT / fault.file
        count = path.read_text().count(fault.right) if path.is_file() and fault.right else 0
        if count != 1:
            yield f"faults.txt: fault {fault.number}: its text occurs {count} times in {fault.file}; choose one that occurs once"


def copy_sources(copy):
    """What git would commit, and the models that examples need. Files that are the same keep their times, so that little is built."""
    listing = subprocess.run(["git", "-C", ROOT, "ls-files", "-co", "--exclude-standard"], check=True, capture_output=True, text=True)
    names = {name for name in listing.stdout.splitlines() if (ROOT / name).is_file()}
    known = copy / "build/sources.json"
    for name in set(json.loads(known.read_text()) if known.is_file() else []) - names:
        (copy / name).unlink(missing_ok=True)
    for name in names:
        content = (ROOT / name).read_bytes()
        target = copy / name
        if not target.is_file() or target.read_bytes() != content:
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_bytes(content)
            target.chmod((ROOT / name).stat().st_mode)
    known.parent.mkdir(exist_ok=True)
    known.write_text(json.dumps(sorted(names)))


def make_tests(copy):
    log = subprocess.run(["make", "-C", copy, "tests"], capture_output=True, text=True)
    if log.returncode != 0:
        sys.exit(f"check_faults: make tests: failed; mend it first\n{log.stdout[-2000:]}{log.stderr[-2000:]}")


def programs_of(copy):
    """The target that each test runs; scripts run the program."""
    call = ["ctest", "--test-dir", copy / "build", "-LE", "slow", "--show-only=json-v1"]
    listing = subprocess.run(call, check=True, capture_output=True, text=True)
    programs = {test["name"]: pathlib.Path(test["command"][0]).name for test in json.loads(listing.stdout)["tests"]}
    return {name: program if program.startswith("nebel_test_") else "nebel_tool" for name, program in programs.items()}


def build(copy, targets):
    call = ["cmake", "--build", copy / "build", "-j", str(os.cpu_count() or 2)]
    done = subprocess.run(call + (["--target", *targets] if targets else []), capture_output=True, text=True)
    return None if done.returncode == 0 else re.findall(r"^.*error.*$", done.stdout + done.stderr, re.M)[:3]


def failing(copy, choice, all_of_them=False):
    """The tests that fail of those that `choice` names by options of ctest: the first, or all of them."""
    call = ["ctest", "--test-dir", copy / "build", "-LE", "slow", "-j", "2", *choice] + ["--stop-on-failure"] * (not all_of_them)
    done = subprocess.run(call, capture_output=True, text=True, env={**os.environ, "NEBEL_TEST_SCALE": SCALE})
    return FAILED.findall(done.stdout)


def find(copy, fault, programs):
    """The suite that finds the fault, None if none does."""
    first = {program for name, program in programs.items() if re.search(fault.suites, name)}
    if not first:
        sys.exit(f"faults.txt: fault {fault.number}: {fault.suites} names no suite of `make test`")
    for targets, choice in ((sorted(first), ["-R", fault.suites]), ([], ["-E", fault.suites])):
        errors = build(copy, targets)
        if errors is not None:
            sys.exit(f"faults.txt: fault {fault.number} does not build: {errors}")
        if found := failing(copy, choice):
            return found[0]
    return None


def try_faults(copy, faults, programs):
    found = {}
    for fault in faults:
        path = copy / fault.file
        text = path.read_text()
        path.write_text(text.replace(fault.right, fault.wrong))
        try:
            found[fault.number] = find(copy, fault, programs)
        finally:
            path.write_text(text)
        suite = found[fault.number]
        print(f"{fault.number:3}  {fault.file:34} {fault.kind:10} {'found by ' + suite if suite else 'NOT FOUND'}", flush=True)
    return found


def main():
    if len(sys.argv) < 2 or not all(number.isdigit() for number in sys.argv[2:]):
        sys.exit(__doc__)
    faults = read_faults()
    if errors := list(check_list(faults)):
        sys.exit("\n".join(errors))
    if not all(0 < int(number) <= len(faults) for number in sys.argv[2:]):
        sys.exit(f"check_faults: there are the faults 1 to {len(faults)}")
    chosen = [faults[int(number) - 1] for number in sys.argv[2:]] or faults
    copy = pathlib.Path(sys.argv[1]).resolve() / "faults"
    copy_sources(copy)
    make_tests(copy)
    found = try_faults(copy, chosen, programs_of(copy))
    suites = sorted(set(found.values()) - {None})
    make_tests(copy)
    broken = failing(copy, ["-R", f"^({'|'.join(suites)})$"], True) if suites else []
    lost = [number for number, suite in found.items() if suite is None or suite in broken]
    if broken:
        print(f"check_faults: fail without any fault: {' '.join(broken)}")
    print(f"check_faults: {len(found) - len(lost)} of {len(found)} faults found")
    return 1 if lost else 0


if __name__ == "__main__":
    sys.exit(main())
