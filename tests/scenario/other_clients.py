#!/usr/bin/env python3
"""The examples for a shell and for MATLAB (run with GNU Octave) against weftd. Octave's is skipped with a message if it is not installed.

    other_clients.py WEFTD WEFT SOURCE_ROOT      all simulated
"""
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

from python_client import write_recipes
from weftd_support import PATIENCE_S, Client, Daemon, outlasted_its_lease, token_of

LEASE_MS, OCTAVE_LEASE_MS = 2000, 5000  # for campaigns that take three times as long; each call of Octave starts programs, which takes time
ENDED = re.compile(r"R-\d+\b.*\bcomplete\b.*\bdone\b.*\bsafe\b")  # the three facts of the run's end
WEFTD, WEFT, ROOT = sys.argv[1], sys.argv[2], pathlib.Path(sys.argv[3]).resolve()


def output_of(*words, status=0, **environment):
    ran = subprocess.run([str(w) for w in words], capture_output=True, text=True, timeout=PATIENCE_S, env={**os.environ, **environment})
    assert ran.returncode == status, f"{words}: {ran.returncode}\n{ran.stdout}\n{ran.stderr}"
    return ran.stdout + ran.stderr


def slow(daemon, lease_ms):
    """Slows the simulated bench: the small recipe lasts at least three leases."""
    client = Client(daemon.socket)
    pace = client.call("recipe.check", recipe="small")["plan"]["eta_s"] / (3 * lease_ms / 1000)
    client.call("sim.clock", pace=pace)
    return client, pace


def shell(daemon):
    if shutil.which("nc") is None:
        return print("nc is not installed (netcat-openbsd): the shell's example was not run")
    printed = output_of(ROOT / "clients/shell/campaign.sh", "learns", WEFT_SOCKET=str(daemon.socket))
    assert ENDED.search(printed) and "  now " in printed, printed
    assert re.search(r"^R-\d+: state [a-z_]+$", printed, re.M), f"no state of the submitted run: {printed}"
    refused = output_of(ROOT / "clients/shell/campaign.sh", "none", status=1, WEFT_SOCKET=str(daemon.socket))
    assert "recipe.check" in refused and '"kind"' in refused, refused
    client, pace = slow(daemon, LEASE_MS)
    printed = output_of(ROOT / "clients/shell/campaign.sh", "small", WEFT_SOCKET=str(daemon.socket), WEFT_LEASE_MS=str(LEASE_MS))
    assert ENDED.search(printed) and "lost" not in printed, printed
    outlasted_its_lease(client, LEASE_MS)
    client.call("sim.clock", pace=0)
    print(f"shell: a campaign run, and one at {pace:.0f} times real time that outlasts its lease of {LEASE_MS} ms")


def octave(daemon, token):
    if shutil.which("octave") is None or shutil.which("curl") is None:
        return print("octave or curl is not installed: MATLAB's example was not run")
    http = re.search(r"http://\S+", daemon.ready).group()
    environment = {"WEFT_HTTP": http, "WEFT_TOKEN": token, "WEFT_RECIPE": "small", "WEFT_LEASE_MS": str(OCTAVE_LEASE_MS)}
    client, _ = slow(daemon, OCTAVE_LEASE_MS)
    printed = output_of("octave", "--no-gui", "--norc", ROOT / "clients/matlab/first_campaign.m", **environment)
    assert ENDED.search(printed) and "lost" not in printed, printed
    outlasted_its_lease(client, OCTAVE_LEASE_MS)
    means = dict(re.findall(r"^(\w+) +2 trials\b.* ([\d.]+)$", printed, re.M))
    assert set(means) == {"denim", "silk"}, printed
    refused = output_of("octave", "--no-gui", "--norc", "--eval", f"addpath('{ROOT}/clients/matlab'); weft_rpc('run.get', struct('ran', 'x'))",
                      status=1, **environment)
    assert "run.get" in refused, refused
    print("octave: a campaign run, means", means)
    return means


def agrees(means, file):
    """h5py gives the same means, if it is installed."""
    try:
        import h5py
    except ImportError:
        return print("h5py is not installed: the means were not compared")
    with h5py.File(file) as h5:
        labels = [label.decode() for label in h5["trials/label"]]
        for name, told in means.items():
            total = rows = 0
            for i in (k for k, label in enumerate(labels) if label == name):
                first, samples = int(h5["trials/taxel_first"][i]), int(h5["trials/taxel_samples"][i])
                counts = h5["taxel/counts"][first:first + samples][h5["taxel/phase"][first:first + samples] == ord("M")]
                total, rows = total + int(counts.sum()), rows + counts.size
            assert abs(total / rows - float(told)) <= 0.0005, (name, total / rows, told)


def main():
    with tempfile.TemporaryDirectory(prefix="weft-client-") as name:
        folder = pathlib.Path(name)
        write_recipes(folder)
        learns = json.loads((folder / "recipes/small.json").read_text())
        (folder / "recipes/learns.json").write_text(json.dumps({**learns, "repetitions": 4, "hand_over": {"learner": "lda", "groups": 2}}))
        token = token_of(WEFT, folder / "tokens.json", "lab", "operator")
        daemon = Daemon(WEFTD, ROOT, folder, "--http", "0", "--tokens", folder / "tokens.json")
        try:
            shell(daemon)
            means = octave(daemon, token)
            if means:
                agrees(means, sorted(daemon.socket.parent.glob("R-*/dataset.h5"))[-1])
            assert daemon.end() == 0
        finally:
            daemon.process.kill()


main()
