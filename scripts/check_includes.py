#!/usr/bin/env python3
"""Checks the #include lines of the project against the table of rooms in docs/internal.md.

Prints every offending line and exits 1 where there is one.
"""

import pathlib
import re
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent

# Which rooms of src/ a room may enter beside itself and EVERYWHERE. They form a directed graph without circles: a room comes after all
# that it may enter.
EVERYWHERE = {"formulas", "base", "math"}
ROOMS = {
    "formulas": set(),
    "base": set(),
    "math": set(),
    "medium": set(),
    "fog": {"medium"},
    "light": {"fog", "medium"},
    "stream": set(),
    "trace": {"light", "fog", "medium", "stream"},
    "diffusion": {"trace", "light", "fog", "medium"},
    "classic": {"trace", "stream", "fog", "medium"},
    "cells": {"medium"},
    "particles": {"medium"},
    "atmosphere": {"medium"},
    "planet": set(),
    "clouds": {"atmosphere", "planet", "medium"},
    "shader": {"diffusion", "light", "fog", "medium", "atmosphere"},
    "frame": set(),
    "aerial": {"frame"},
    "cpu": {"aerial", "frame"},
    "gl": {"aerial", "frame"},
    "file": set(),
    "json": set(),
    "image": {"file"},
    "grid_file": {"file", "image", "json", "keys"},
    "keys": {"json"},
    "photograph": {"file", "image", "json"},
    "model": {"file", "image", "json", "keys"},
    "model_reader": {"file", "image", "json", "keys", "model"},
    "scene": {"file", "json", "image", "grid_file", "keys", "model", "photograph", "aerial", "frame"},
}

# Everything outside src/ uses the public face and its own folder. Tests and fuzzers may enter every room.
OUTSIDE = ("tools", "examples", "bench")

C_STANDARD = set("""assert.h complex.h ctype.h errno.h fenv.h float.h inttypes.h iso646.h limits.h locale.h math.h setjmp.h
    signal.h stdalign.h stdarg.h stdatomic.h stdbool.h stddef.h stdint.h stdio.h stdlib.h stdnoreturn.h string.h tgmath.h
    threads.h time.h uchar.h wchar.h wctype.h""".split())
POSIX = {"fcntl.h", "unistd.h", "dirent.h", "sys/types.h", "sys/stat.h", "sys/ioctl.h", "sys/resource.h", "sys/time.h",
         "sys/wait.h", "sys/mman.h", "sys/random.h", "strings.h"}

# Headers of other people, by the places that may use them; a trailing slash stands for a folder.
FOREIGN = {
    "formulas": {"immintrin.h", "arm_neon.h"},
    "base": {"cpuid.h", "sys/auxv.h"},
    "file": POSIX | {"poll.h"},
    "json": {"yajl/", "jsmn.h"},
    "image": POSIX | {"png.h", "jpeglib.h", "jerror.h", "openexr.h", "OpenEXR/", "zlib.h", "webp/"},
    "grid_file": {"strings.h", "nanovdb/", "zlib.h", "blosc.h", "openvdb/", "exception", "new"},
    "photograph": POSIX,
    "model": POSIX | {"assimp/", "poll.h", "spawn.h", "sys/syscall.h", "linux/openat2.h"},
    "model_reader": POSIX | {"assimp/", "meshoptimizer.h", "sys/prctl.h", "sys/syscall.h", "linux/landlock.h", "linux/audit.h",
                             "linux/filter.h", "linux/seccomp.h"},
    # What nebel info says about libraries.
    "scene": POSIX | {"assimp/version.h", "blosc.h", "jpeglib.h", "openexr.h", "png.h", "yajl/yajl_version.h", "zlib.h", "webp/encode.h"},
    "cpu": {"embree3/", "omp.h"},
    "gl": {"epoxy/"},
    "tools": POSIX | {"sched.h", "omp.h", "mpi.h", "epoxy/", "GLFW/", "imgui.h", "backends/"},
    "bench": POSIX | {"omp.h", "embree3/", "epoxy/", "png.h"},
    "examples": {"epoxy/", "GLFW/", "SDL.h", "windows.h", "d3d9.h"},
}

INCLUDE = re.compile(r'^\s*#\s*include\s+([<"])([^>"]+)[>"]')
PUBLIC = re.compile(r"nebel/\w+\.h$")


def place_of(path):
    """The room of a file under src/, or its top folder."""
    parts = path.relative_to(ROOT).parts
    return parts[1] if parts[0] == "src" else parts[0]


def is_foreign_allowed(place, name):
    allowed = FOREIGN.get(place, set())
    return name in C_STANDARD or any(name == a or (a.endswith("/") and name.startswith(a)) for a in allowed)


def own_target(path, name):
    """The file of ours that a quoted include means, or None."""
    for folder in (path.parent, ROOT, ROOT / "src", ROOT / "include"):
        target = (folder / name).resolve()
        if target.is_file():
            return target
    return None


def judge(path, quote, name):
    """What is wrong with an include line, or None."""
    place = place_of(path)
    if PUBLIC.match(name):
        return None if (ROOT / "include" / name).is_file() else "no such public header"
    if quote == "<":
        return None if is_foreign_allowed(place, name) else f"{place} may not use <{name}>"
    target = own_target(path, name)
    if target is None:
        return f'"{name}" is no file of the project'
    if ROOT not in target.parents:
        return f'"{name}" is outside the project'
    there = place_of(target)
    if there == place or (place, there) == ("tools", "bench"):
        return None
    if place in ROOMS and (there in ROOMS[place] or there in EVERYWHERE and place != "formulas"):
        return None
    return f"{place} may not enter {there}"


def sources():
    roots = [ROOT / "include", ROOT / "src"] + [ROOT / folder for folder in OUTSIDE]
    for root in roots:
        for path in sorted(root.rglob("*")):
            if path.suffix in (".c", ".h", ".inc", ".cpp"):
                yield path


def main():
    faults = []
    count = 0
    for path in sources():
        place = place_of(path)
        if path.is_relative_to(ROOT / "src") and place not in ROOMS:
            faults.append(f"{path.relative_to(ROOT)}: room {place} is not in the table of scripts/check_includes.py")
        for number, line in enumerate(path.read_text().splitlines(), 1):
            match = INCLUDE.match(line)
            if match is None:
                continue
            count += 1
            fault = judge(path, match[1], match[2])
            if fault is not None:
                faults.append(f"{path.relative_to(ROOT)}:{number}: {fault}")
    print("\n".join(faults + [f"check_includes: {count} include lines, {len(faults)} faults"]))
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
