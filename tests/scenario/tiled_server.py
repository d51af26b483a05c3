#!/usr/bin/env python3
"""A finished data set served by Tiled's HDF5 adapter on 127.0.0.1 with an API key, as docs/howto/bluesky.md shows, and read by Tiled's client. Every array,
its type and its metadata is compared with h5py's own reading of the file. Packages from PyPI at pinned versions (tiled_server.txt).

    tiled_server.py WEFT SOURCE_ROOT FOLDER      FOLDER has their virtual environment, and is made if it does not exist

Exit 77 (skipped) if PyPI cannot be reached or is too slow.
"""
import hashlib
import json
import os
import pathlib
import re
import secrets
import socket
import subprocess
import sys
import tempfile
import threading

import pypi_environment

if __name__ == "__main__":
    pypi_environment.enter(sys.argv[3], pathlib.Path(__file__).with_suffix(".txt"))

import h5py
import httpx
import numpy
from tiled.client import from_uri
from tiled.queries import Key

from cli_support import Checks
from emulated_support import free_port

ROOT = pathlib.Path(sys.argv[2]).resolve()
READY_S = 120  # from the start to the last indexed file; takes 5 s on an idle machine


class Server:
    """`tiled serve directory` on a folder of campaigns. The key is in its environment only: the process list shows arguments to every user."""

    def __init__(self, folder, home):
        self.key, self.port = secrets.token_hex(32), free_port(socket.SOCK_STREAM)
        self.process = subprocess.Popen([pathlib.Path(sys.prefix) / "bin/tiled", "serve", "directory", folder, "--host", "127.0.0.1", "--port", str(self.port)],
                                        env={**os.environ, "HOME": str(home), "TILED_SINGLE_USER_API_KEY": self.key}, text=True,
                                        stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
        self.said, self.ready = [], threading.Event()
        threading.Thread(target=self.read, daemon=True).start()

    def read(self):
        for line in self.process.stdout:
            self.said.append(line)
            if "Indexing complete" in line:
                self.ready.set()
        self.ready.set()

    def __enter__(self):
        self.ready.wait(READY_S)
        if self.process.poll() is not None or "Indexing complete" not in "".join(self.said):
            self.__exit__()
            raise AssertionError("tiled is not ready:\n" + "".join(self.said))
        return self

    def __exit__(self, *_):
        self.process.terminate()
        try:
            self.process.wait(30)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()


def access(t, server):
    """Nothing without the key, nothing on another address, no key in the process list."""
    url = f"http://127.0.0.1:{server.port}/api/v1/metadata/R-000001/dataset"
    codes = [httpx.get(url, headers={"Authorization": f"Apikey {key}"} if key else {}).status_code for key in ("", "0" * 64, server.key)]
    t.expect(codes == [401, 401, 200], f"without, with a wrong and with the right key: {codes}")
    with socket.socket() as other:
        t.expect(other.connect_ex(("127.0.0.2", server.port)) != 0, "the server listens on other addresses")
    t.expect(server.key.encode() not in pathlib.Path(f"/proc/{server.process.pid}/cmdline").read_bytes() and server.key not in "".join(server.said),
             "the key is shown")


def plain(attributes):
    """Attributes of HDF5 as JSON has them."""
    return {name: value.decode() if isinstance(value, bytes) else value.item() for name, value in attributes.items()}


def arrays(t, served, path):
    """Every array of the file. Returns their number and bytes."""
    count = size = 0
    with h5py.File(path) as file:
        def compare(name, node):
            nonlocal count, size
            if isinstance(node, h5py.Group):
                metadata = dict(served[name].metadata)
                t.expect(sorted(served[name]) == sorted(node) and plain(node.attrs).items() <= metadata.items(), f"group {name}: {metadata}")
                return
            read, expected = served[name].read(), node[()]
            count, size = count + 1, size + expected.nbytes
            same = numpy.array_equal(numpy.ravel(read), numpy.ravel(expected)) and (read.shape == node.shape or node.shape == ())
            t.expect(same and read.dtype == node.dtype, f"{name}: {read.dtype} {read.shape}, not {node.dtype} {node.shape}")
            t.expect(plain(node.attrs).items() <= dict(served[name].metadata).items(), f"{name}: metadata {dict(served[name].metadata)}")

        t.expect(sorted(served) == sorted(file), f"groups: {sorted(served)}")
        file.visititems(compare)
    return count, size


def program_of_the_page(t, server, path):
    """The program of docs/howto/bluesky.md: force of one trial in SI units, and a search by digest."""
    block, = (text for text in re.findall(r"^```python\n(.*?)^```$", (ROOT / "docs/howto/bluesky.md").read_text(), re.M | re.S) if "tiled" in text)
    assert "http://127.0.0.1:8000" in block and "TILED_SINGLE_USER_API_KEY" in block, block
    os.environ["TILED_SINGLE_USER_API_KEY"] = server.key
    names = {}
    exec(block.replace(":8000", f":{server.port}"), names)
    with h5py.File(path) as file:
        first, samples = (int(file[f"trials/wrench_{part}"][3]) for part in ("first", "samples"))
        expected = file["wrench/quanta"][first:first + samples, 2] / file["wrench/quanta"].attrs["per_unit"]
    t.expect(first > 0 and numpy.array_equal(names["fz_n"], expected) and 2 < expected.max() < 4, f"Fz up to {expected.max()} N")
    t.expect(list(names["same"]) == ["dataset"], f"search: {list(names['same'])}")


def main():
    t = Checks(sys.argv[1])
    with tempfile.TemporaryDirectory(prefix="weft-tiled-") as name:
        d = pathlib.Path(name).resolve()
        os.environ["HOME"] = str(d / "home")
        (d / "home").mkdir()
        recipe = json.loads((ROOT / "recipes/library/vibro-slide.json").read_text())
        recipe.pop("$schema")
        recipe.update(name="small", fabrics=["denim", "silk"], repetitions=2)
        for phase in recipe["explorations"]["V1"]["phases"]:
            phase.update({"path": [{"dx_mm": 0, "dy_mm": 4}]} if "path" in phase else {"duration_s": 0.5})
        (d / "small.json").write_text(json.dumps(recipe))
        ran = t.run("run", "small.json", "--rig", ROOT / "sim/rigs/vibro17.json", "--out", "data/R-000001", "--no-evaluate", "--no-error-check", cwd=d)
        assert ran.returncode == 0, ran.stderr
        path = d / "data/R-000001/dataset.h5"
        before = {file: hashlib.sha256(file.read_bytes()).digest() for file in (d / "data").rglob("*") if file.is_file()}
        with h5py.File(path) as file:
            attributes = plain(file.attrs)
        certificate = json.loads((d / "data/R-000001/certificate.json").read_text())
        with Server(d / "data", d / "home") as server:
            access(t, server)
            client = from_uri(f"http://127.0.0.1:{server.port}", api_key=server.key)
            served = client["R-000001/dataset"]
            t.expect(dict(served.metadata) == attributes, f"metadata: {dict(served.metadata)}")
            digest = served.metadata["dataset_sha256"]
            t.expect(served.metadata["bench_kind"] == "simulated" and len(digest) == len(served.metadata["recipe_sha256"]) == 64
                     and digest in json.dumps(certificate), "digests and the kind of the bench")
            found = [list(client["R-000001"].search(Key("dataset_sha256") == of)) for of in (digest, "0" * 64)]
            t.expect(found == [["dataset"], []], f"search by digest: {found}")
            count, size = arrays(t, served, path)
            program_of_the_page(t, server, path)
            t.expect(count > 40 and {"acceleration", "sound", "taxel"} <= set(served), f"{count} arrays of {sorted(served)}")
        after = {file: hashlib.sha256(file.read_bytes()).digest() for file in (d / "data").rglob("*") if file.is_file()}
        t.expect(after == before, f"files changed: {set(after.items()) ^ set(before.items())}")
        print(f"SIMULATED data set served by Tiled: {count} arrays, {size} bytes equal h5py's")
    t.finish()


if __name__ == "__main__":
    main()
