#!/usr/bin/env python3
"""Tries every number of every good scene at and beyond the limits that docs/scene.schema.json states: the reader must
refuse what the schema refuses, at that number and with its key, and take what the schema takes, unless another number
of the scene stands against it."""

import json
import math
import os
import pathlib
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
JUDGE = pathlib.Path(os.environ.get("NEBEL_BUILD", ROOT / "build")) / "tests/scene_judge"
SCENES = [*ROOT.glob("fuzz/corpus/scene/*.json"), *ROOT.glob("examples/engines/*.json")]
COMMENT = re.compile(r'("(?:\\.|[^"\\])*")|//[^\n]*|/\*.*?\*/', re.S)
PROBES = [-1e300, -1e18, -1.0, -1e-300, 0.0, 1e-300, 1e-12, 0.5, 1.0, 2.0, 1e12, 1e18, 1e300]

# What the reader may hold against a number that is within its own limits: what it has to do with others.
ACROSS = re.compile(
    r"greater than min|less than max|same place|lies \S+ m from|more than \"start\"|looks at its own|along \"up\"|"
    r"larger first|has no direction|long; the length|no rotation|both radii|must ascend|makes the |makes a |"
    r"times the emission|flat or sheared|has the normal 0|body is empty|another sign|differs from|they must be the same|"
    r"is outside cell|outside cell|has no area|is not convex|overlap|has no end|has no bounds|at least -?\S+ m$|"
    r"so it must be|reads version 1|fog here overwrites|another scale along|above 1000000|"
    r"all fog here has one|does not touch|inner_angle|from 0 to outer_angle|units of|cannot read the (model|grid|picture)|"
    r"of two voxels each|th of the distance|scale heights from the center|(of|times) the (thickness|radius)|radius / 1e6 or more|\(the thickness\)|above the base|within the air|z_near must be less")

# Stands in a text where a number will.
SENTINEL = "\x01"


class Schema:
    """What the schema says of single numbers. A validator would take minutes for so many scenes."""

    def __init__(self, root):
        self.root = root
        self.visited = set()

    def resolve(self, node):
        while "$ref" in node:
            node = self.root["$defs"][node["$ref"].removeprefix("#/$defs/")]
        return node

    def fits(self, node, value):
        """Whether a value has this form, whatever its numbers."""
        node = self.resolve(node)
        kinds = {"object": dict, "array": list, "string": str, "number": (int, float), "integer": (int, float),
                 "boolean": bool}
        if "oneOf" in node and not any(self.fits(branch, value) for branch in node["oneOf"]):
            return False
        if not all(self.fits(part, value) for part in node.get("allOf", [])):
            return False
        if isinstance(node.get("const"), str) or "enum" in node:
            return value in node.get("enum", [node.get("const")])
        if "type" in node and not isinstance(value, kinds[node["type"]]):
            return False
        if not isinstance(value, dict) or "properties" not in node:
            return True
        known = node["properties"]
        closed = node.get("additionalProperties", True) is False
        return (set(node.get("required", [])) <= set(value) and (not closed or set(value) <= set(known))
                and all(self.fits(known[key], item) for key, item in value.items() if key in known))

    def parts(self, node, value):
        """All that the schema says of a value."""
        node = self.resolve(node)
        found = [node]
        for part in node.get("allOf", []):
            found += self.parts(part, value)
        if isinstance(value, (int, float)):
            return found
        for branch in node.get("oneOf", []):
            if self.fits(branch, value):
                found += self.parts(branch, value)
        return found

    def numbers(self, node, value, path=()):
        """The paths of all numbers of a scene, and what is said of each."""
        nodes = self.parts(node, value)
        if isinstance(value, (int, float)) and not isinstance(value, bool):
            yield path, nodes
        for part in nodes:
            if isinstance(value, dict):
                self.visited |= {id(part["properties"][key]) for key in value if key in part.get("properties", {})}
                items = [(key, part["properties"][key], item) for key, item in value.items()
                         if key in part.get("properties", {})]
            elif isinstance(value, list) and "items" in part:
                items = [(i, part["items"], item) for i, item in enumerate(value)]
            else:
                items = []
            for key, inner, item in items:
                yield from self.numbers(inner, item, (*path, key))

    def allows(self, node, number):
        node = self.resolve(node)
        if "oneOf" in node and not any(self.allows(branch, number) for branch in node["oneOf"]):
            return False
        return all((node.get("type", "number") in ("number", "integer"),
                    node.get("type") != "integer" or number == math.floor(number),
                    number == node.get("const", number), number in node.get("enum", [number]),
                    node.get("minimum", -math.inf) <= number <= node.get("maximum", math.inf),
                    node.get("exclusiveMinimum", -math.inf) < number < node.get("exclusiveMaximum", math.inf)))

    def bounds(self, node):
        node = self.resolve(node)
        found = {node[key] for key in ("minimum", "maximum", "exclusiveMinimum", "exclusiveMaximum") if key in node}
        return found.union(*(self.bounds(branch) for branch in node.get("oneOf", [])))

    def unvisited(self, node, path):
        """The keys that no scene had."""
        items = enumerate(node) if isinstance(node, list) else node.items() if isinstance(node, dict) else ()
        for key, item in items:
            if key == "properties":
                yield from (f"{path}.{name}" for name, inner in item.items() if id(inner) not in self.visited)
            yield from self.unvisited(item, f"{path}/{key}")


def read_scene(path):
    """A scene in metres: there the schema and the reader mean the same numbers."""
    scene = json.loads(COMMENT.sub(lambda match: match[1] or " ", path.read_text()))
    return {**scene, "unit": 1} if "unit" in scene else scene


def with_number(scene, path, number):
    """The text of a scene with another number, and where that stands, as the reader says it."""
    copy = json.loads(json.dumps(scene))
    at = copy
    for key in path[:-1]:
        at = at[key]
    at[path[-1]] = SENTINEL
    text = json.dumps(copy, indent=1, ensure_ascii=False)
    start = text.index(json.dumps(SENTINEL))
    line = text.count("\n", 0, start) + 1
    column = start - (text.rfind("\n", 0, start) + 1) + 1
    name = "".join(f"[{key}]" if isinstance(key, int) else f".{key}" for key in path).lstrip(".")
    return text.replace(json.dumps(SENTINEL), repr(number)), f"{line}:{column}: {name}: "


def probes_of(schema, nodes):
    probes = set(PROBES)
    for bound in set().union(*(schema.bounds(node) for node in nodes)):
        probes |= {float(bound), math.nextafter(bound, -math.inf), math.nextafter(bound, math.inf), bound - 1.0,
                   bound + 1.0}
    return sorted(probes)


def cases(schema):
    """(name, text, place, number, whether the schema allows it), each kind of number once."""
    done = set()
    for path in sorted(SCENES):
        scene = read_scene(path)
        for where, nodes in schema.numbers(schema.root, scene):
            kind = (tuple(id(node) for node in nodes), tuple(key for key in where if isinstance(key, str)))
            if kind in done:
                continue
            done.add(kind)
            for number in probes_of(schema, nodes):
                yield path, *with_number(scene, where, number), number, all(schema.allows(n, number) for n in nodes)


def ask(tried):
    words = "".join(f"{path}\0{text}\0" for path, text, *_ in tried)
    run = subprocess.run([JUDGE], input=words.encode(), stdout=subprocess.PIPE, check=True)
    lines = run.stdout.decode().splitlines()
    assert len(lines) == len(tried), f"{len(lines)} answers to {len(tried)} scenes"
    return lines


def judge(answer, path, place, allowed):
    """What is wrong with an answer; "" where it is right."""
    if not allowed:
        return "" if answer.startswith(f"{path}:{place}") else f"wanted an error at {place}"
    return "" if answer == "good" or ACROSS.search(answer) else "the schema allows it"


def main():
    schema = Schema(json.loads((ROOT / "docs/scene.schema.json").read_text()))
    tried = list(cases(schema))
    faults = [f"no scene has {name}" for name in schema.unvisited(schema.root, "")]
    for (path, _, place, number, allowed), answer in zip(tried, ask(tried)):
        fault = judge(answer, path, place, allowed)
        if fault:
            faults.append(f"{path.relative_to(ROOT)}: {place}{number!r}: {fault}: {answer}")
    good = sum(allowed for *_, allowed in tried)
    print(f"{len(tried)} numbers tried, {good} of them within their limits")
    if good < 1000 or len(tried) - good < 1000:
        faults.append("too few: this check needs mending")
    print("\n".join(faults[:200]))
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
