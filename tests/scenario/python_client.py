#!/usr/bin/env python3
"""Installs clients/python with pip into clean virtual environments, without a registry; then runs its scene against weftd, and the notebook's cells
as a script.

    python_client.py WEFTD WEFT SOURCE_ROOT      all simulated
"""
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

import client_wheel
from weftd_support import PATIENCE_S, Daemon, certificate, token_of

WEFTD, WEFT, ROOT = sys.argv[1], sys.argv[2], pathlib.Path(sys.argv[3]).resolve()
SKIPPED = 77


def run(*words, **more):
    ran = subprocess.run([str(w) for w in words], capture_output=True, text=True, timeout=PATIENCE_S, **more)
    assert ran.returncode == 0, f"{words}: {ran.returncode}\n{ran.stdout}\n{ran.stderr}"
    return ran.stdout


def environment(folder, name, *options):
    """Makes a virtual environment with the client, as `pip install clients/python` does. Returns its Python."""
    run(sys.executable, "-m", "venv", *options, folder / name)
    python = folder / name / "bin/python"
    run(python, "-m", "pip", "install", "--quiet", folder / "python", env={**os.environ, **client_wheel.OFFLINE})
    return python


def write_recipes(folder):
    (folder / "recipes").mkdir()
    small = json.loads((ROOT / "recipes/library/first.json").read_text())
    for key in "$schema", "hand_over":
        small.pop(key)
    small.update(fabrics=["denim", "silk"], repetitions=2)
    (folder / "recipes/small.json").write_text(json.dumps(small))
    (folder / "recipes/long.json").write_text(json.dumps({**small, "repetitions": 20}))
    steps = [{"before": "fabric", "text": "Mount {fabric}.", "people_s": 1}]
    (folder / "recipes/people.json").write_text(json.dumps({**small, "operator_steps": steps}))


def scene(folder, python):
    """Two daemons: one on the socket and 127.0.0.1, one under TLS."""
    tokens = folder / "tokens.json"
    (key, cert), (_, other_cert) = (certificate(folder, name, "DNS:localhost,IP:127.0.0.1") for name in ("good", "other"))
    scene_of = {role: token_of(WEFT, tokens, role, role) for role in ("observer", "operator")}
    ports = "--tokens", tokens, "--port", "0", "--http", "0"
    daemon = Daemon(WEFTD, ROOT, folder, *ports)
    secure = Daemon(WEFTD, ROOT, folder, *ports, "--tls-cert", cert, "--tls-key", key, data="secure")
    try:
        http, https = (re.search(r"https?://[^:]+:(\d+)", d.ready).group(1) for d in (daemon, secure))
        scene_of.update(socket=str(daemon.socket), tcp=f"tcp://127.0.0.1:{daemon.port}", http=f"http://127.0.0.1:{http}",
                        tls=f"tls://127.0.0.1:{secure.port}", https=f"https://127.0.0.1:{https}", ca=str(cert), other_ca=str(other_cert), folder=str(folder))
        (folder / "scene.json").write_text(json.dumps(scene_of))
        print(run(python, "-I", ROOT / "tests/scenario/python_client_scene.py", folder / "scene.json").strip())
        assert daemon.end() == 0 and secure.end() == 0
    finally:
        daemon.process.kill()
        secure.process.kill()


def notebook(folder, pythons):
    daemon = Daemon(WEFTD, ROOT, folder, data="notebook")
    try:
        for python in pythons:
            printed = run(python, "-I", ROOT / "clients/python/tests/run_notebook.py", ROOT / "clients/python/examples/first_campaign.ipynb",
                       env={**os.environ, "WEFT_SOCKET": str(daemon.socket), "WEFT_RECIPE": "small"})
            assert re.search(r"\bcomplete\b.*\bdone\b.*\bsafe\b", printed), printed
            print(printed.strip().splitlines()[-1])
    finally:
        daemon.process.kill()


def main():
    reason = client_wheel.missing() or (None if shutil.which("openssl") else "openssl is not installed")
    if reason:
        print(f"skipped: {reason}")
        return SKIPPED
    with tempfile.TemporaryDirectory(prefix="weft-client-") as name:
        folder = pathlib.Path(name)
        write_recipes(folder)
        shutil.copytree(ROOT / "clients/python", folder / "python", ignore=shutil.ignore_patterns("build", "*.egg-info"))
        clean, system = environment(folder, "clean"), environment(folder, "system", "--system-site-packages")
        scene(folder, clean)
        notebook(folder, [clean, system])
    return 0


if __name__ == "__main__":
    sys.exit(main())
