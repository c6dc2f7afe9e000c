#!/usr/bin/env python3
"""docs/classic.md says for each technique of old hardware which function has it, which test checks it and which picture shows it: whether
all of them are there."""

import pathlib
import re
import unittest

ROOT = pathlib.Path(__file__).resolve().parent.parent
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


class ClassicPage(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.rows = read_rows()
        cls.headers = "".join(path.read_text(encoding="utf-8") for path in (ROOT / "include/nebel").glob("*.h"))
        cls.words = (ROOT / "src/cpu/renderer.c").read_text(encoding="utf-8")

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
            for word in re.findall(r"`--method (\w+)`", function):
                self.assertIn(f'"{word}"', self.words, name)

    def test_tests_are_there(self):
        for name, (_, test, _) in self.rows.items():
            files = re.findall(r"`(\w+\.(?:c|py))`", test)
            self.assertTrue(files, name)
            for file in files:
                self.assertTrue(any((ROOT / "tests" / folder / file).exists() for folder in (".", "d3d9")), f"{name}: {file}")

    def test_pictures_are_there(self):
        for name, (_, _, picture) in self.rows.items():
            files = re.findall(r"\]\((pictures/[\w.-]+)\)", picture)
            self.assertTrue(files, name)
            for file in files:
                self.assertGreater((ROOT / "docs" / file).stat().st_size, 1000, f"{name}: {file}")


if __name__ == "__main__":
    unittest.main()
