"""Importing the core is quick and brings nothing that only some users need."""

from __future__ import annotations

import subprocess
import sys

HEAVY = ("torch", "gymnasium", "rerun", "matplotlib", "cvxpy")

CODE = f"""
import sys, time
start = time.process_time()
import rigdda
print(time.process_time() - start, [name for name in {HEAVY} if name in sys.modules])
"""


def test_import():
    out = subprocess.run([sys.executable, "-c", CODE], capture_output=True, text=True, check=True)
    seconds, loaded = out.stdout.split(maxsplit=1)
    assert loaded.strip() == "[]"
    assert float(seconds) < 2.0  # of processor time, which other load does not change
