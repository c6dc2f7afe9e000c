#!/usr/bin/env python3
"""Checks what a compiler does not: lengths of functions and files, white space, names, lost tests.

The budget: functions at most 15 lines in the median, at most 2 in 100 over 60 lines, none over 120; files at most 800
lines. Prints every fault and exits 1 where there is one.
"""

import pathlib
import re
import statistics
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent

MEDIAN_LINES = 15
LONG_LINES = 60
LONG_SHARE = 0.02
LONGEST_LINES = 120
FILE_LINES = 800

CODE = {".c", ".h", ".inc", ".cpp", ".glsl", ".hlsl"}
TEXT = CODE | {".py", ".sh", ".cmake", ".md", ".json", ".txt", ".in", ".map"}

# Reserved names that belong to the compiler, the C library or an interface we call.
GIVEN = re.compile(r"""_Static_assert|_exit|_Alignas|_Alignof|_Noreturn|_Generic|_Thread_local|_Bool|_Atomic|_Pragma|_OPENMP
    |_POSIX_C_SOURCE|_XOPEN_SOURCE|_GNU_SOURCE|_DEFAULT_SOURCE|_FILE_OFFSET_BITS|_WIN32|_MSC_VER
    |__[A-Za-z0-9_]+__|__cplusplus|__VA_ARGS__|__builtin_\w+|__has_\w+|__VERSION__
    |__m(64|128|256|512)[id]?|__mmask\d+|_mm\d*_\w+|_SC_\w+|_MM_\w+|_CMP_\w+|__get_cpuid\w*|__cpuid\w*|__u?int128|__float128""", re.X)
IDENTIFIER = re.compile(r"\b[A-Za-z_]\w*")
PASTED = re.compile(r"\b\w*\s*##\s*\w*(?:\s*##\s*\w*)*")
UNFINISHED = re.compile(r"\b(" + "|".join(("TO" + "DO", "FIX" + "ME", "XX" + "X", "HA" + "CK")) + r")\b")
LITERALS = re.compile(r'//[^\n]*|/\*.*?\*/|"(?:\\.|[^"\\\n])*"|\'(?:\\.|[^\'\\\n])+\'', re.S)
DIRECTIVE = re.compile(r"^[ \t]*#(?:[^\n]*\\\n)*[^\n]*", re.M)
CPLUSPLUS = re.compile(r"^[ \t]*#[ \t]*ifdef[ \t]+__cplusplus\b.*?^[ \t]*#[ \t]*endif", re.M | re.S)
SIGNATURE = re.compile(r"([A-Za-z_]\w*)\s*\([^{};]*\)\s*$")


def blank(match):
    """As many line ends as the text had, so that line numbers stay."""
    return "\n" * match[0].count("\n") or " "


def without_literals(text):
    return LITERALS.sub(lambda m: '""' if m[0][0] in "\"'" else blank(m), text)


def functions_of(text):
    """(name, first line, lines) of every function body at file level."""
    text = CPLUSPLUS.sub(blank, text)
    text = DIRECTIVE.sub(blank, text)
    found = []
    depth = 0
    outer = 0  # where the text since the last thing at file level begins
    opened = None
    for match in re.finditer(r"[{};]", text):
        position = match.start()
        if match[0] == "{":
            if depth == 0:
                head = SIGNATURE.search(text, outer, position)
                opened = (head[1], head.start(1)) if head else None
            depth += 1
        elif match[0] == "}":
            depth -= 1
            if depth < 0:
                return None
            if depth == 0 and opened is not None:
                first = text.count("\n", 0, opened[1]) + 1
                found.append((opened[0], first, text.count("\n", 0, position) + 2 - first))
        if depth == 0:
            outer = position + 1
    return found if depth == 0 else None


def project_files():
    listing = subprocess.run(["git", "-C", str(ROOT), "ls-files", "-co", "--exclude-standard"],
                             check=True, capture_output=True, text=True)
    for name in sorted(set(listing.stdout.splitlines())):
        path = ROOT / name
        if path.match("tests/truth/*.json"):
            continue  # reference data, kept byte for byte as it was computed
        if path.is_file() and (path.suffix in TEXT or name in ("Makefile", ".ci/run", "LICENSE")):
            yield path


def check_text(path, text):
    """White space, characters and unfinished work."""
    if text and not text.endswith("\n"):
        yield 0, "no newline at the end"
    if text.endswith("\n\n"):
        yield 0, "empty lines at the end"
    for number, line in enumerate(text.split("\n"), 1):
        if line != line.rstrip():
            yield number, "white space at the end of the line"
        if "\t" in line and path.name != "Makefile":
            yield number, "a tab"
        if path.suffix in CODE and not line.isascii():
            yield number, "a character outside ASCII"
        if UNFINISHED.search(line):
            yield number, "unfinished work: mend it or file it"


def check_names(path, code):
    for number, line in enumerate(code.split("\n"), 1):
        for name in IDENTIFIER.findall(PASTED.sub(" ", line)):
            if (name.startswith("_") or "__" in name) and not GIVEN.fullmatch(name):
                yield number, f"reserved name {name}"
            elif path.suffix == ".inc" and "__" in name:
                yield number, f"{name}: GLSL reserves two underscores in a row"


def check_tests(path, code):
    """Every test that a file defines is also run by it."""
    for match in re.finditer(r"^static void (test_\w+)\(void \*\*\s*\w+\)\s*\{", code, re.M):
        if len(re.findall(rf"\b{match[1]}\b", code)) < 2:
            yield code.count("\n", 0, match.start()) + 1, f"{match[1]} is never run"


def check_code(path, text, lengths):
    code = without_literals(text)
    yield from check_names(path, code)
    lines = text.count("\n")
    if lines > FILE_LINES:
        yield 0, f"{lines} lines, {FILE_LINES} are allowed"
    if path.parent.name == "tests" and path.name.startswith("test_"):
        yield from check_tests(path, code)
    if path.suffix in (".glsl", ".hlsl"):
        return
    functions = functions_of(code)
    if functions is None:
        yield 0, "braces do not pair"
        return
    for name, first, length in functions:
        lengths.append((length, f"{path.relative_to(ROOT)}:{first}: {name}"))
        if length > LONGEST_LINES:
            yield first, f"{name} has {length} lines, {LONGEST_LINES} are allowed"


def check_budget(lengths):
    """Faults of the whole: the median and the share of long functions."""
    if not lengths:
        return
    median = statistics.median(length for length, place in lengths)
    long = sorted((entry for entry in lengths if entry[0] > LONG_LINES), reverse=True)
    if median > MEDIAN_LINES:
        yield f"functions have {median} lines in the median, {MEDIAN_LINES} are allowed"
    if len(long) > LONG_SHARE * len(lengths):
        yield f"{len(long)} of {len(lengths)} functions have more than {LONG_LINES} lines:"
        yield from (f"    {place} ({length})" for length, place in long)


def main():
    faults = []
    lengths = []
    for path in project_files():
        name = path.relative_to(ROOT)
        try:
            text = path.read_text(encoding="utf-8")
        except UnicodeDecodeError:
            faults.append(f"{name}: not UTF-8")
            continue
        found = list(check_text(path, text))
        if path.suffix in CODE:
            found += check_code(path, text, lengths)
        faults += [f"{name}:{number}: {fault}" if number else f"{name}: {fault}" for number, fault in found]
    budget = list(check_budget(lengths))
    median = statistics.median(length for length, place in lengths) if lengths else 0
    print("\n".join(faults + budget + [f"check_style: {len(lengths)} functions, {median:g} lines in the median, "
                                       f"{len(faults) + len(budget)} faults"]))
    return 1 if faults or budget else 0


if __name__ == "__main__":
    sys.exit(main())
