"""The wheel of clients/python, built by Debian's pip and setuptools without a registry."""
import importlib.util
import os
import pathlib
import shutil
import subprocess
import sys

WHEELS = pathlib.Path("/usr/share/python-wheels")  # Debian's python3-pip-whl, -setuptools-whl and -wheel-whl
OFFLINE = {"PIP_NO_INDEX": "1", "PIP_FIND_LINKS": str(WHEELS), "PIP_DISABLE_PIP_VERSION_CHECK": "1"}
LIMIT_S = 240


def missing():
    """A sentence on the Debian package that is missing, or None."""
    for name in "pip", "setuptools", "wheel":
        if not list(WHEELS.glob(f"{name}-*.whl")):
            return f"python3-{name}-whl is not installed"
    return None if importlib.util.find_spec("ensurepip") else "python3-venv is not installed"


def build(root, folder):
    """Builds in `folder`, from a copy of the sources. Returns the wheel's path."""
    shutil.copytree(root / "clients/python", folder / "source", ignore=shutil.ignore_patterns("build", "*.egg-info", "__pycache__"))
    for words in (["venv", str(folder / "builder")], ["pip", "wheel", "--quiet", "--no-deps", "--wheel-dir", str(folder / "dist"), str(folder / "source")]):
        python = sys.executable if words[0] == "venv" else folder / "builder/bin/python"
        ran = subprocess.run([python, "-m", *words], env={**os.environ, **OFFLINE}, capture_output=True, text=True, timeout=LIMIT_S)
        assert ran.returncode == 0, f"{words}: {ran.returncode}\n{ran.stdout}\n{ran.stderr}"
    wheel, = (folder / "dist").glob("*.whl")
    return wheel
