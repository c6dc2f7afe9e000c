#!/usr/bin/env python3
"""Checks that a name leads to one place: every tag of a structure, union or enumeration, and every name of a type, is defined in one file
of include/, src/, tools/ and bench/, and the files of src/ have names of their own. Prints every name with two places and exits 1 where
there is one.
"""

import collections
import pathlib
import re
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
FOLDERS = ("include", "src", "tools", "bench")

# The preludes of formulas define the same types for C, double and SIMD; one of them is included.
PRELUDES = re.compile(r"src/formulas/prelude_\w+\.h$")

COMMENT = re.compile(r"/\*.*?\*/|//[^\n]*", re.S)
TAG = re.compile(r"^(?:typedef )?(?:struct|union|enum) (\w+)\s*\{", re.M)
TYPE = re.compile(r"^(?:typedef [^;{]*?\b(\w+)(?:\[\w*\])*;|\} (\w+)(?:\[\w*\])*;)", re.M)
FORWARD = re.compile(r"^typedef (?:struct|union|enum) (\w+) \1;", re.M)


def types_of(text):
    """Tags that a text defines, and names of types; forward declarations define nothing."""
    text = FORWARD.sub("", COMMENT.sub("", text))
    return set(TAG.findall(text)) | {a or b for a, b in TYPE.findall(text)}


def main():
    places = collections.defaultdict(set)
    files = collections.defaultdict(set)
    for folder in FOLDERS:
        for path in sorted((ROOT / folder).rglob("*")):
            if path.suffix not in (".c", ".h", ".inc", ".cpp", ".glsl"):
                continue
            name = str(path.relative_to(ROOT))
            if folder == "src":
                files[path.name].add(name)
            if path.suffix != ".glsl" and not PRELUDES.match(name):
                for tag in types_of(path.read_text()):
                    places[tag].add(name)
    faults = [f"{name}: {', '.join(sorted(where))}" for table in (places, files) for name, where in sorted(table.items())
              if len(where) > 1]
    print("\n".join(faults + [f"check_tags: {len(places)} types, {len(files)} files, {len(faults)} faults"]))
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
