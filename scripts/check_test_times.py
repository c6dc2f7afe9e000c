#!/usr/bin/env python3
"""check_test_times.py BUILD [LIMIT]: the ten longest tests of the last run of ctest with --output-junit BUILD/tests.xml, and an error for
each that took over LIMIT seconds (5) without the label `slow` or `smoke`: `make test` must stay an answer in minutes.
"""

import json
import subprocess
import sys
import xml.etree.ElementTree


def labels_of(build):
    text = subprocess.run(["ctest", "--test-dir", build, "--show-only=json-v1"], check=True, capture_output=True,
                          text=True).stdout
    return {test["name"]: {word for entry in test.get("properties", []) if entry["name"] == "LABELS"
                           for word in entry["value"]} for test in json.loads(text)["tests"]}


def main():
    if len(sys.argv) not in (2, 3):
        sys.exit(__doc__)
    build, limit = sys.argv[1], float(sys.argv[2]) if len(sys.argv) == 3 else 5
    labels = labels_of(build)
    cases = xml.etree.ElementTree.parse(f"{build}/tests.xml").getroot().iter("testcase")
    times = sorted(((float(case.get("time")), case.get("name")) for case in cases), reverse=True)
    for seconds, name in times[:10]:
        print(f"{seconds:7.1f} s  {name}  {' '.join(sorted(labels[name]))}")
    late = [(seconds, name) for seconds, name in times if seconds > limit and not labels[name] & {"slow", "smoke"}]
    for seconds, name in late:
        print(f"check_test_times: {name} took {seconds:.1f} s: make it try less, or name it in slow_tests of "
              "tests/CMakeLists.txt", file=sys.stderr)
    return 1 if late else 0


if __name__ == "__main__":
    sys.exit(main())
