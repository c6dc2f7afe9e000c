#!/usr/bin/env python3
"""docs/classic.md says for each technique of old hardware which function has it, which test checks it and which picture shows it: whether
all of them are there."""

import pathlib
import re
import sys
import unittest

ROOT = pathlib.Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "scripts"))
sys.dont_write_bytecode = True

import draw_classic  # noqa: E402

TECHNIQUES = [f"A{i}" for i in (1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 12)] + [f"C{i}" for i in range(1, 5)] + [f"D{i}" for i in range(1, 6)]


def read_rows():
    """{technique: [function, test, picture]} of the table."""
    text = (ROOT / "docs/classic.md").read_text(encoding="utf-8")
    section = text[text.index("## What is where"):text.index("## Mistakes that were printed")]
    rows = {}
    for line in section.splitlines():
        cells = [cell.strip() for cell in line.strip("|").split(" | ")]
        if re.match(r"\| [ACD]\d", line):
            rows[cells[0].split()[0]] = [cell.strip(" |") for cell in cells[1:]]
    return rows


def method_words(text):
    """Of "`--method linear`, `exp`, `fog-coord`": a list of words goes on until something else stands in it."""
    lists = re.findall(r"`--method ([\w-]+)`((?:, `[\w-]+`)*)(?!\w)", text)
    return [word for first, others in lists for word in [first, *re.findall(r"`([\w-]+)`", others)] if not word.startswith("nebel_")]


class ClassicPage(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.rows = read_rows()
        cls.headers = "".join(path.read_text(encoding="utf-8") for path in (ROOT / "include/nebel").glob("*.h"))
        cls.words = (ROOT / "src/cpu/cpu_renderer.c").read_text(encoding="utf-8")

    def test_every_technique_has_a_row(self):
        self.assertEqual(list(self.rows), TECHNIQUES)
        for name, cells in self.rows.items():
            self.assertEqual(len(cells), 3, name)
            self.assertTrue(all(cells), f"{name}: a cell is empty")

    def test_functions_are_declared(self):
        for name, (function, _, _) in self.rows.items():
            names = re.findall(r"\b(?:nebel|NEBEL)_\w+", function)
            self.assertTrue(names or "--" in function, name)
            for word in names:
                self.assertRegex(self.headers, rf"\b{word}\b", name)
            for word in method_words(function):
                self.assertIn(f'"{word}"', self.words, name)

    def test_tests_are_there(self):
        for name, (_, test, _) in self.rows.items():
            files = re.findall(r"`(\w+\.(?:c|py))`", test)
            self.assertTrue(files, name)
            for file in files:
                self.assertTrue(any((ROOT / "tests" / folder / file).exists() for folder in (".", "d3d9")), f"{name}: {file}")

    def test_one_command_draws_the_pictures(self):
        page = set(re.findall(r"pictures/([\w.-]+)", (ROOT / "docs/classic.md").read_text(encoding="utf-8")))
        self.assertEqual(page - set(draw_classic.names()) - set(draw_classic.ELSEWHERE), set())
        self.assertEqual(set(draw_classic.names()) - page, set())
        for scene, *_ in draw_classic.DRAWN.values():
            self.assertTrue((ROOT / f"examples/scenes/{scene}.json").exists(), scene)

    def test_methods_stand_beside_the_exact_one(self):
        """A picture of a method has a line of a table with the exact picture, and one with its difference."""
        lines = (ROOT / "docs/classic.md").read_text(encoding="utf-8").splitlines()
        differing = {picture: exact for picture, exact, _ in draw_classic.DIFFERENCES.values()}
        for name, (scene, size, *options) in draw_classic.DRAWN.items():
            if "--method" not in options:
                continue
            beside = [line for line in lines if f"]({'pictures/' + name}.png) " in line and line.startswith("| ![")]
            self.assertTrue(any("exact" in line and "-difference.png" in line for line in beside), name)
            self.assertIn(name, differing)

    def test_pictures_are_there(self):
        for name, (_, _, picture) in self.rows.items():
            files = re.findall(r"\]\((pictures/[\w.-]+)\)", picture)
            self.assertTrue(files, name)
            for file in files:
                self.assertGreater((ROOT / "docs" / file).stat().st_size, 500, f"{name}: {file}")


if __name__ == "__main__":
    unittest.main()
