#!/usr/bin/env python3
"""docs/reference/api.md matches the daemon's own description, and its examples work: those for a shell with nc, and that in Python.

    api_document.py WEFTD SOURCE_ROOT [--write]      --write: only write the page
"""
import contextlib
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

from weftd_support import PATIENCE_S, Client, Daemon, outlasted_its_lease

SKIPPED = 77
LEASE_MS = 2000  # of the example
TITLES = {"system": "The daemon", "session": "Users and access", "lease": "Leases", "rig": "The rig", "device": "Devices", "handover": "Handovers", "recipe": "Recipes",
          "run": "Runs", "queue": "The queue", "classify": "Votes", "data": "Data sets", "sim": "The simulation", "sub": "Events", "log": "Journal", "token": "Tokens",
          "rpc": "This document", "$/cancel": "Calls that wait"}


@contextlib.contextmanager
def daemon_with_a_recipe(weftd, root, folder):
    for name in "recipes", "data":
        (folder / name).mkdir()
    small = json.loads((root / "recipes/library/m1.json").read_text())
    small.update(fabrics=["denim"], repetitions=1)
    (folder / "recipes/small.json").write_text(json.dumps({k: v for k, v in small.items() if k != "$schema"}))
    daemon = Daemon(weftd, root, folder)
    yield daemon
    assert daemon.end() == 0


def sentence(text):
    """The text with a capital first letter. The rest stays, because names have capitals of their own."""
    return text[:1].upper() + text[1:]


def kind(types):
    return types if isinstance(types, str) else " or ".join(types)


def rows(methods):
    for method in methods:
        yield f"### {method['name']}\n"
        role = f"Least role: {method['x-role']}. " + ("Changes something. " if method["x-changes"] else "")
        yield f"{sentence(method['summary'])}. {role}Result: {method['result']['description']}.\n"
        if method["params"]:
            yield "| parameter | type | |\n|---|---|---|"
            for p in method["params"]:
                needed = ", needed" if p["required"] else ""
                yield f"| `{p['name']}` | {kind(p['schema']['type'])}{needed} | {p['description']} |"
            yield ""


def page(document, head):
    out = [head.rstrip(), "", f"# Methods of version {document['info']['version']}", ""]
    nouns = []
    for method in document["methods"]:
        noun = method["name"].split(".")[0]
        nouns += [] if noun in nouns else [noun]
    for noun in nouns:
        out += [f"## {TITLES.get(noun, noun)}", ""]
        out += rows(m for m in document["methods"] if m["name"].split(".")[0] == noun)
    return "\n".join(out).rstrip() + "\n"


def run(command, environment):
    ran = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE_S, env={**os.environ, **environment})
    assert ran.returncode == 0, f"{command}: {ran.returncode} {ran.stdout} {ran.stderr}"
    return ran.stdout


def answers(text):
    return {m["id"]: m for m in map(json.loads, text.splitlines()) if "id" in m}


def shell_examples(text, environment):
    """Indented blocks, in order: ready and recipes, halt, reset, an error."""
    blocks = [b for b in re.findall(r"(?:^    .*\n)+", text, re.M) if "nc -U" in b]
    assert len(blocks) == 4, f"{len(blocks)} examples with nc"
    ready, halt, reset, refused = (run(["bash", "-euc", block], environment) for block in blocks)
    replies = answers(ready)
    assert replies[2]["result"] == {"ok": True, "blockers": []}, ready
    assert replies[3]["result"]["recipes"] == ["small"], ready
    assert '"latched"' in halt and '"halt"' in halt, halt
    assert "result" in answers(reset)[2], reset
    error = answers(refused)[2]["error"]
    assert error["data"]["kind"] == "param.unknown" and "run" in error["data"]["hint"], refused


def python_example_that_loses_its_lease(client, example, environment):
    """The lease is broken during the run: the run and the waiting client still end normally."""
    client.call("sub.open", topics=["run:*"], mode="every")
    with subprocess.Popen([sys.executable, "-c", example], env={**os.environ, **environment}, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True) as process:
        client.until("R-000002", "running")
        client.call("lease.break", lease=client.call("lease.list")["leases"][0]["lease"], reason="a test")
        client.call("sim.clock", pace=0)
        printed = process.communicate(timeout=PATIENCE_S)[0]
    assert process.returncode == 0 and "complete done safe" in printed and re.search(r"lost.*'where': '/params/lease'", printed), printed


def main():
    weftd, root, write = sys.argv[1], pathlib.Path(sys.argv[2]).resolve(), "--write" in sys.argv
    target, folder = root / "docs/reference/api.md", pathlib.Path(tempfile.mkdtemp(prefix="weft-api-"))
    try:
        with daemon_with_a_recipe(weftd, root, folder) as daemon:
            made = page(Client(daemon.socket).call("rpc.discover"), (root / "docs/reference/api.head.md").read_text())
            if write:
                target.write_text(made)
                return 0
            assert target.read_text() == made, "docs/reference/api.md does not agree with the daemon: api_document.py WEFTD ROOT --write"
            environment = {"WEFT_SOCKET": str(daemon.socket), "WEFT_RECIPE": "small", "WEFT_LEASE_MS": str(LEASE_MS)}
            client = Client(daemon.socket)
            bench_s = client.call("recipe.check", recipe="small")["plan"]["eta_s"]
            client.call("sim.clock", pace=bench_s / (3 * LEASE_MS / 1000))  # slow enough that the run outlasts its lease
            (example,) = re.findall(r"```python\n(.*?)```", made, re.S)
            lines = run([sys.executable, "-c", example], environment).splitlines()
            assert "complete done safe" in lines, lines[-3:]
            assert any(line.startswith("event run:R-000001") for line in lines), lines
            outlasted_its_lease(client, LEASE_MS)
            python_example_that_loses_its_lease(client, example, environment)
            client.call("sim.clock", pace=0)
            if shutil.which("nc") is None:
                print("nc is not installed (netcat-openbsd): the examples for a shell were not run")
                return SKIPPED
            shell_examples(made, environment)
            print(f"{made.count('### ')} methods, 5 examples run")
    finally:
        shutil.rmtree(folder)
    return 0


if __name__ == "__main__":
    sys.exit(main())
