#!/usr/bin/env python3
"""Checks that a name leads to one place: every tag of a structure, union or enumeration, and every name of a type, is defined in one file
of include/, src/, tools/ and bench/, the files of src/ have names of their own, and so have the static functions and variables of a room,
which may be compiled as one unit. What the caller gives an object has one place, too: nebel_host, first member of its description.
Prints every fault and exits 1 where there is one.
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

# Sources that are never in a unit with others; nebel_set_unity in cmake/NebelTargets.cmake finds them in the same manner.
ALONE = re.compile(r'^ *# *include "formulas/(?:prelude\.h|[a-z_]+\.inc)"|^ *# *define NB_DOUBLE', re.M)
INCLUDE = re.compile(r'^ *# *include "(?:\w+/)?(\w+\.h)"', re.M)

DIRECTIVE = re.compile(r"^#(?:[^\n]*\\\n)*[^\n]*", re.M)
STATIC = re.compile(r"^(?:[A-Z_]+ )?(?:static|NB_ALWAYS_INLINE)\b[^;={(]*?\b(\w+)(?:\[[^\]]*\])*(?:\(| =|;)", re.M)
STRUCT = re.compile(r"^typedef struct (\w+) \{\n(.*?)^\}", re.M | re.S)
HOST = re.compile(r"^ *nebel_(?:allocator|log|parallel|host) \w+;", re.M)

STATIC_STRUCT = re.compile(r"^static [^;={(]*\{[^}]*^\} (\w+)(?:\[[^\]]*\])*(?: =|;)", re.M)


def types_of(text):
    """Tags that a text defines, and names of types; forward declarations define nothing."""
    text = FORWARD.sub("", COMMENT.sub("", text))
    return set(TAG.findall(text)) | {a or b for a, b in TYPE.findall(text)}


def statics_of(text):
    """Functions and variables that a clang-formatted text defines for itself."""
    text = DIRECTIVE.sub("", COMMENT.sub("", text))
    return set(STATIC.findall(text)) | set(STATIC_STRUCT.findall(text))


def places_in_rooms():
    """The static names of each room, with the sources that have them."""
    alone = {path.name for path in ROOT.glob("src/*/*.h") if path.parent.name != "formulas" and ALONE.search(path.read_text())}
    places = collections.defaultdict(set)
    for path in sorted(ROOT.glob("src/*/*.c")):
        text = path.read_text()
        if path.stem.endswith("_kernel") or ALONE.search(text) or alone & set(INCLUDE.findall(text)):
            continue
        for name in statics_of(text):
            places[f"{path.parent.name}: {name}"].add(str(path.relative_to(ROOT)))
    return places


def host_faults():
    """Structures of public headers with an allocator, a log or threads of their own, or whose host is not the first member."""
    for path in sorted((ROOT / "include").rglob("*.h")):
        for name, members in STRUCT.findall(COMMENT.sub("", path.read_text())):
            given = [line.strip() for line in HOST.findall(members)]
            if name != "nebel_host" and given and (given != ["nebel_host host;"] or not members.startswith("    nebel_host host;")):
                yield f"{path.relative_to(ROOT)}: {name}: `nebel_host host;` must be its first member, in place of {', '.join(given)}"


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
    statics = places_in_rooms()
    faults = [f"{name}: {', '.join(sorted(where))}" for table in (places, files, statics)
              for name, where in sorted(table.items()) if len(where) > 1] + list(host_faults())
    counts = f"{len(places)} types, {len(files)} files, {len(statics)} static names, {len(faults)} faults"
    print("\n".join(faults + [f"check_tags: {counts}"]))
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
