#!/usr/bin/env python3
"""The coefficients of the elementary functions and the tables of sRGB are those that scripts/ derives."""
import os
import subprocess
import sys

root = os.environ["NEBEL_SOURCE"]


def check(script, *files):
    command = [sys.executable, os.path.join(root, "scripts", script), "--check"]
    return subprocess.call(command + [os.path.join(root, "src", file) for file in files])


sys.exit(check("fit_elementary.py", "formulas/elementary.inc", "stream/stream_packet.h") or
         check("make_srgb.py", "stream/srgb_table.c"))
