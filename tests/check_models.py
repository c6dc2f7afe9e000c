#!/usr/bin/env python3
"""Damages some models of assimp-testmodels, where they are installed, and sees that none harms the program; NEBEL_TEST_SCALE says how
many. scripts/damage_models.py tries thousands."""

import os
import pathlib
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
COUNT = max(1, int(60 * float(os.environ.get("NEBEL_TEST_SCALE", "1"))))

sys.exit(subprocess.run([sys.executable, ROOT / "scripts/damage_models.py", os.environ["NEBEL"], "--count", str(COUNT), "--jobs", "2",
                         "--seed", "5"], check=False).returncode)
