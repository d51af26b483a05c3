#!/usr/bin/env python3
"""Checks the Python client with mypy's strict mode; skipped if Debian's mypy is not installed.

    python_types.py ROOT
"""
import pathlib
import shutil
import subprocess
import sys
import tempfile

mypy = shutil.which("mypy", path="/usr/bin")
if mypy is None:
    print("mypy is not installed: types were not checked")
    sys.exit(77)
with tempfile.TemporaryDirectory() as cache:
    client = pathlib.Path(sys.argv[1]) / "clients/python"
    sys.exit(subprocess.run([mypy, "--config-file", "pyproject.toml", "--cache-dir", cache, "src"], cwd=client).returncode)
