#!/usr/bin/env python3
"""The coefficients of the elementary functions are those that scripts/fit_elementary.py derives."""
import os
import subprocess
import sys

root = os.environ["NEBEL_SOURCE"]
sys.exit(subprocess.call([sys.executable, os.path.join(root, "scripts", "fit_elementary.py"), "--check",
                          os.path.join(root, "src", "formulas", "elementary.inc"),
                          os.path.join(root, "src", "kernels", "packet.h")]))
