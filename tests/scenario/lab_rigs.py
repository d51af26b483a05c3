#!/usr/bin/env python3
"""A campaign over three rigs with a real PostgreSQL: parts, their merged set, faults at seeded moments, the outbox, secrets and rights. SIMULATED.

    lab_rigs.py WEFT WEFTD SOURCE_ROOT [--seeds N] [--first SEED] [--repetitions N] [--only FAULT,...] [--whole]

--seeds N: each kind of fault at N seeded moments (2). --repetitions N: of a fault's campaign (1). --whole: only khan2016 (680 trials) over
three rigs, once undisturbed and N times with a kill and a restart of the store.
"""
import argparse
import contextlib
import hashlib
import json
import os
import pathlib
import random
import re
import signal
import subprocess
import sys
import tempfile
import threading
import time

import lab_support
from weftd_support import Client, Daemon, token_of

PATIENCE_S = 120  # for a campaign or a state [s]
LEASE_S = 3       # of a part
FABRICS, REPETITIONS = 6, 2
PACE = 600        # a trial takes some 0.1 s to 0.3 s
LEASE_REQUIRED = 2011
GROUP = {"group_columns/values", "trials/sha256"}  # a trial's digest covers its groups
LOGINS = [("rig_a", "weft_rig"), ("rig_b", "weft_rig"), ("rig_c", "weft_rig"), ("rig_d", "weft_rig"), ("submit", "weft_submitter"), ("reader", "weft_reader")]


def password_of(login):
    return f"secret-{login}-of-the-test"


def until(condition, what, patience_s=PATIENCE_S):
    """The first true value of `condition()`."""
    end = time.monotonic() + patience_s
    while not (found := condition()):
        assert time.monotonic() < end, f"not within {patience_s} s: {what() if callable(what) else what}"
        time.sleep(0.05)
    return found


class CommandLines(threading.Thread):
    """Looks for secrets in the command lines of all processes while it runs."""

    def __init__(self, is_secret):
        super().__init__(daemon=True)
        self.is_secret, self.found, self.looks, self.ended = is_secret, [], 0, threading.Event()

    def run(self):
        while not self.ended.wait(0.2):
            for path in pathlib.Path("/proc").glob("[0-9]*/cmdline"):
                with contextlib.suppress(OSError):
                    text = path.read_bytes().decode(errors="replace")
                    if self.is_secret(text):
                        self.found.append(text)
            self.looks += 1


class Rig:
    """A weftd on its own simulated rig, with its own login, and the client of its operator."""

    def __init__(self, lab, name, is_joined=True):
        self.lab, self.name, self.login = lab, name, f"rig_{name}"
        self.folder = lab.folder / f"rig-{name}"
        (self.folder / "recipes").mkdir(parents=True)
        rig = json.loads((lab.root / "sim/rigs/bench17.json").read_text())
        rig["name"] = name
        for table in {"fabrics", "fidelity"} & rig["simulation"].keys():
            rig["simulation"][table] = str((lab.root / "sim/rigs" / rig["simulation"][table]).resolve())
        self.rig = self.folder / f"{name}.json"
        self.rig.write_text(json.dumps(rig))
        self.tokens = self.folder / "tokens.json"
        self.token = token_of(lab.weft, self.tokens, "bo", "operator")
        # The way of this rig alone to the store: a link that a fault removes.
        self.way = lab.folder / f"way-{name}"
        if is_joined:
            self.join()
        self.said, self.daemon, self.client, self.lease = "", None, None, None
        lab.rigs[name] = self

    def join(self):
        self.way.symlink_to(self.lab.server.folder)

    def cut_off(self):
        """No network to the store from now on."""
        self.way.unlink()
        self.lab.server.sql(f"SELECT pg_terminate_backend(pid) FROM pg_stat_activity WHERE usename = '{self.login}'")

    def start(self, pace=PACE, login=None):
        self.daemon = Daemon(self.lab.weftd, self.lab.root, self.folder, "--pace", str(pace), "--port", "0", "--http", "0", "--tokens", self.tokens,
                             "--lab", self.lab.uri(login or self.login, self.way), "--lab-lease", str(LEASE_S), rig=self.rig)
        self.client, self.lease = Client(self.daemon.socket), None
        return self

    def pace(self, pace):
        self.client.call("sim.clock", pace=pace)

    def end(self, how=signal.SIGTERM):
        status = self.daemon.end(how)
        self.said += self.daemon.ready + self.daemon.process.stdout.read() + self.daemon.process.stderr.read()
        return status

    def look_after(self):
        """As a person after a crash: looks, resets, and lets the queue go on."""
        if self.client.call("rig.state")["rig"] != "safe":
            self.client.call("rig.reset", reason="looked at the probe")
        if self.client.call("queue.list").get("paused"):
            self.client.call("queue.resume", lease=self.hold())

    def hold(self, ttl_ms=600_000):
        if self.lease is None:
            self.lease = self.client.call("lease.acquire", ttl_ms=ttl_ms)["lease"]
        return self.lease

    def release(self):
        if self.lease is not None:
            self.client.answer("lease.release", lease=self.lease)
            self.lease = None

    def accept(self, ttl_ms=600_000):
        return self.client.call("lab.accept", lease=self.hold(ttl_ms))

    def withdraw(self):
        self.client.call("lab.withdraw")
        self.release()

    def status(self):
        return self.client.call("lab.status")

    def await_published(self):
        until(lambda: self.lab.server.sql(f"SELECT count(*) FROM weft.rig WHERE name = '{self.name}'") == "1", self.status, 20)
        return self

    def part(self):
        return self.status()["part"]

    def in_a_trial(self):
        """Its run, when a trial of a part is under way."""
        part = self.part()
        if not part or not part["run"] or part["is_lost"]:
            return None
        run = self.client.call("run.get", run=part["run"])
        return run if run["state"] == "running" else None

    def runs(self):
        """{run: state, or the outcome of an ended one}."""
        found, cursor = {}, {}
        while True:
            page = self.client.call("run.list", most=100, **cursor)
            for run in page["runs"]:
                found[run["run"]] = run.get("outcome") or run["state"] if run["state"] == "ended" else run["state"]
            if not page.get("next"):
                return found
            cursor = {"from": page["next"]}

    def alone(self):
        """Records a small campaign of its own. Its run."""
        recipe = json.loads(self.lab.recipe.read_text())
        recipe.update(name="own", fabrics=["denim"], repetitions=1, seed=random.getrandbits(32))
        (self.folder / "recipes/own.json").write_text(json.dumps(recipe))
        run = self.client.call("run.start", recipe="own", lease=self.hold())["run"]
        ended = self.client.call("run.wait", run=run)
        assert ended["outcome"] == "complete", ended
        return run

    def journal(self, kind):
        return self.client.call("log.query", kind=kind, most=1000)["lines"]


class Lab:
    """The store, its logins with passwords in files, and three rigs."""

    def __init__(self, weft, weftd, root, folder, server, repetitions=1):
        self.weft, self.weftd, self.root, self.folder, self.server = weft, weftd, root, folder, server
        self.logins = [name for name, _ in LOGINS]
        server.make_lab(*LOGINS)
        self.command("install", uri=server.uri("admin"))
        server.grant(*LOGINS)
        # Statements with a password are kept out of the server's log, as an administrator should.
        subprocess.run(["psql", "-X", "-q", "-v", "ON_ERROR_STOP=1", "-d", server.uri("admin")], check=True, capture_output=True, text=True, timeout=PATIENCE_S,
                       input="SET log_min_duration_statement = -1;" + "".join(f"ALTER ROLE {login} PASSWORD '{password_of(login)}';" for login in self.logins))
        for login in self.logins:
            file = folder / f"pass-{login}"
            file.write_text(f"*:*:lab:{login}:{password_of(login)}\n")
            file.chmod(0o600)
        server.write(server.data / "pg_hba.conf", "local all admin trust\nlocal all all scram-sha-256\n")
        server.stop()
        server.start()
        # Digests of all tokens that were ever given.
        server.sql("CREATE TABLE public.given (token_sha256 bytea);"
                   "CREATE FUNCTION public.note() RETURNS trigger LANGUAGE plpgsql SECURITY DEFINER AS $$ BEGIN INSERT INTO public.given VALUES "
                   "(NEW.token_sha256); RETURN NEW; END $$; CREATE TRIGGER note AFTER INSERT OR UPDATE ON weft.part_lease "
                   "FOR EACH ROW EXECUTE FUNCTION public.note()")
        self.said, self.rigs = "", {}
        recipe = json.loads((root / "recipes/library/khan2016.json").read_text())
        del recipe["$schema"]
        recipe["fabrics"] = recipe["fabrics"][:FABRICS]
        self.recipe = self.write_recipe({**recipe, "name": "short", "repetitions": REPETITIONS})
        self.single = self.write_recipe({**recipe, "name": "single", "fabrics": recipe["fabrics"][:1], "repetitions": REPETITIONS})
        self.disturbed = self.write_recipe({**recipe, "name": "disturbed", "repetitions": repetitions})
        self.fetched = 0
        self.references = {}

    def write_recipe(self, recipe):
        file = self.folder / f"{recipe['name']}.json"
        file.write_text(json.dumps(recipe))
        return file

    def uri(self, login, host=None):
        return f"postgresql://{login}@/lab?host={host or self.server.folder}&passfile={self.folder}/pass-{login}"

    def run(self, *args, env=None):
        done = subprocess.run([str(self.weft), *map(str, args)], capture_output=True, text=True, cwd=self.folder, timeout=600, check=False,
                              stdin=subprocess.DEVNULL, env={**{k: v for k, v in os.environ.items() if not k.startswith("PG")}, **(env or {})})
        self.said = getattr(self, "said", "") + done.stdout + done.stderr
        return done

    def command(self, *args, uri=None, expect=0, env=None):
        done = self.run("lab", *args, "--json", *(["--lab", uri] if uri else []), env=env)
        assert done.returncode == expect, (args, done.returncode, done.stdout, done.stderr)
        return json.loads(done.stdout)

    def sql_of(self, login, sql):
        """Output of a statement of this login, with its password."""
        return subprocess.run(["psql", "-X", "-A", "-t", "-q", "-v", "ON_ERROR_STOP=1", "-d", self.uri(login), "-c", sql], check=True, capture_output=True,
                              text=True, timeout=PATIENCE_S).stdout.strip()

    def submit(self, recipe=None, rigs="a,b,c", more=()):
        return self.command("submit", recipe or self.recipe, "--rigs", rigs, *more, uri=self.uri("submit"))["campaign"]

    def campaign(self, campaign):
        return self.command("campaign", campaign, uri=self.uri("reader"))

    def part_rows(self, campaign):
        """(fabric, state, holder, attempt), without a process of Weft's: for loops."""
        rows = self.server.sql(f"SELECT fabric, state, coalesce(holder, ''), attempt FROM weft.part WHERE campaign = {int(campaign[2:])} ORDER BY number")
        return [tuple(row.split("|")) for row in rows.splitlines()]

    def await_done(self, campaign, patience_s=PATIENCE_S):
        def done():
            states = {row[1] for row in self.part_rows(campaign)}
            assert "failed" not in states and "cancelled" not in states, self.campaign(campaign)
            return states == {"done"}
        until(done, lambda: (self.part_rows(campaign), [(rig.name, rig.status(), rig.client.call("rig.state")) for rig in self.rigs.values()
                                                        if rig.daemon.process.poll() is None]), patience_s)

    def reference(self, recipe):
        """One rig records all fabrics: {fabric: digest}, and the merged set by rig."""
        if recipe not in self.references:
            out, began = self.folder / f"one-rig-{pathlib.Path(recipe).stem}", time.monotonic()
            ran = self.run("run", recipe, "--part", "1/1", "--rig", self.rigs["a"].rig, "--out", out, "--no-evaluate", "--no-error-check", "--json")
            assert ran.returncode == 0, ran.stderr
            merged = out / "merged.h5"
            self.merge([out], merged)
            self.references[recipe] = ({one["fabric"]: one["dataset_sha256"] for one in json.loads(ran.stdout)["campaigns"]}, merged)
            print(f"SIMULATED: one rig: {json.loads(ran.stdout)['virtual_s'] / 3600:.2f} h of bench time in {time.monotonic() - began:.1f} s", flush=True)
        return self.references[recipe]

    def merge(self, inputs, out):
        ran = self.run("dataset", "merge", "--by-rig", *inputs, "-o", out, "--json")
        assert ran.returncode == 0, ran.stderr
        return json.loads(ran.stdout)

    def fetch(self, campaign, env=None):
        self.fetched += 1
        out = self.folder / f"fetched-{self.fetched}"
        files = self.command("fetch", campaign, "--out", out, uri=self.uri("reader"), env=env)["files"]
        return out, files

    def tokens(self, rig, token):
        """Environment with one rig's token for `weft lab fetch`."""
        file = self.folder / "tokens.txt"
        file.write_text(f"{rig} {token}\n")
        return {"WEFT_LAB_TOKENS": str(file)}

    def check(self, campaign, recipe=None, env=None):
        """Every trial once and equal to the one-rig run; every rig at rest, with nothing unpublished; every run in the store with its final state."""
        recipe = recipe or self.recipe
        digests, reference = self.reference(recipe)
        whole = self.campaign(campaign)
        parts = whole["parts"]
        assert whole["state"] == "done" and [part["state"] for part in parts] == ["done"] * len(digests), whole
        assert {part["fabric"]: part["dataset_sha256"] for part in parts} == digests, (parts, digests)
        out, files = self.fetch(campaign, env)
        merged = self.folder / f"{out.name}.h5"
        told = self.merge([file["file"] for file in files], merged)
        trials = self.compare(merged, reference, {part["fabric"]: part["rig"] for part in parts})
        assert told["trials"] == trials and told["datasets"] == len(digests), told
        for rig in self.rigs.values():
            self.settled(rig)
        return parts, merged

    def compare(self, merged, reference, holders):
        """All columns of two sets are equal but the group of the rig. Returns the number of trials."""
        import h5py
        with h5py.File(merged, "r") as a, h5py.File(reference, "r") as b:
            names = []
            b.visititems(lambda name, item: names.append(name) if isinstance(item, h5py.Dataset) else None)
            there = []
            a.visititems(lambda name, item: there.append(name) if isinstance(item, h5py.Dataset) else None)
            assert names == there, (names, there)
            for name in set(names) - GROUP - {"provenance/rig_json"}:
                assert a[name].shape == b[name].shape and a[name].dtype == b[name].dtype, name
                assert a[name][()].tobytes() == b[name][()].tobytes() if a[name].dtype.kind != "O" else list(a[name][()]) == list(b[name][()]), name
            labels = [label.decode() for label in a["trials/label"][()]]
            keys = list(zip(labels, a["trials/exploration"][()], a["trials/repetition"][()]))
            assert len(keys) == len(set(keys)) == len(b["trials/label"]), "a trial is lost or doubled"
            assert [name.decode() for name in a["group_columns/name"][()]] == ["rig"]
            assert [rig.decode() for rig in a["group_columns/values"][()]] == [holders[label] for label in labels], holders
            return len(keys)

    def settled(self, rig):
        """Safe, with an empty outbox and no part."""
        if rig.daemon.process.poll() is not None:
            return
        until(lambda: (s := rig.status())["unpublished"] == 0 and s["part"] is None and s["is_connected"], lambda: (rig.name, rig.status()), 40)
        state = rig.client.call("rig.state")
        # The place where a killed daemon left its rig is unknown until a person has looked and the next run has been there.
        assert state["rig"] == "safe" or state["acknowledged"] and rig.runs()[state["left_by"]] == "interrupted", state
        local = rig.runs()
        listed = self.command("runs", "--rig", rig.name, "--limit", "1000", uri=self.uri("reader"))["runs"]
        stored = {run["run"]: run["state"] for run in listed}
        assert stored == local, (rig.name, stored, local)
        assert set(local.values()) <= {"complete", "interrupted", "stopped"}, (rig.name, local)
        assert {run["bench"] for run in listed} <= {"simulated"}, listed


def plain_campaign(lab):
    """Three rigs take all parts; each data set has the digest of the one-rig run. By place, then over HTTP; then evaluated by rig."""
    lab.rigs["a"].accept()
    lab.rigs["b"].accept()
    person = subprocess.Popen([lab.weft, "lab", "accept", "--socket", lab.rigs["c"].daemon.socket, "--json"], stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                              text=True)
    until(lambda: lab.rigs["c"].status()["accepted_by"], lab.rigs["c"].status)
    began = time.monotonic()
    campaign = lab.submit()
    lab.await_done(campaign)
    lasted = time.monotonic() - began
    parts, merged = lab.check(campaign)
    assert {part["rig"] for part in parts} == {"a", "b", "c"}, parts
    known = until(lambda: (found := lab.rigs["a"].client.call("lab.rigs"))["read_us"] and found, lab.rigs["a"].status, 10)
    assert [(rig["rig"], rig["bench"]) for rig in known["rigs"]] == [(name, "simulated") for name in "abc"], known
    person.send_signal(signal.SIGINT)
    out, err = person.communicate(timeout=PATIENCE_S)
    lab.said += out + err
    assert person.returncode == 0 and json.loads(out)["accepted_by"] is None and lab.rigs["c"].status()["accepted_by"] is None, (out, err)
    over_http(lab, campaign, parts)
    evaluated(lab, campaign, merged)
    print(f"SIMULATED: {len(parts)} parts over three rigs in {lasted:.1f} s", flush=True)


def over_http(lab, campaign, parts):
    """The store's path of one rig's files is not there: they come over HTTP with a token, and only with it."""
    of_b = [part["fabric"] for part in parts if part["rig"] == "b"]
    lab.server.sql("UPDATE weft.dataset d SET place = '/nowhere' || d.place FROM weft.run r WHERE r.id = d.run_id AND r.rig = 'b'")
    refused = lab.run("lab", "fetch", campaign, "--out", lab.folder / "refused", "--lab", lab.uri("reader"),
                      env=lab.tokens("b", "wft_wrong"))
    elsewhere = lab.command("fetch", campaign, "--out", lab.folder / "refused", uri=lab.uri("reader"), expect=1, env=lab.tokens("a", lab.rigs["a"].token))
    assert elsewhere["error"]["code"] == "not found" and "b" in elsewhere["error"]["where"], elsewhere
    assert refused.returncode == 1 and "wft_wrong" not in refused.stdout + refused.stderr, refused
    assert of_b and not any((lab.folder / f"refused/{fabric}.h5").exists() for fabric in of_b), list((lab.folder / "refused").iterdir())
    lab.check(campaign, env=lab.tokens("b", lab.rigs["b"].token))
    lab.server.sql("UPDATE weft.dataset d SET place = substr(d.place, 9) FROM weft.run r WHERE r.id = d.run_id AND r.rig = 'b'")
    # A fabric's name that would leave the folder is refused.
    number = f"campaign = {int(campaign[2:])} AND fabric = "
    lab.server.sql(f"UPDATE weft.part SET fabric = '../escaped' WHERE {number}'{of_b[0]}'")
    lab.command("fetch", campaign, "--out", lab.folder / "within/it", uri=lab.uri("reader"), expect=1)
    assert not list(lab.folder.rglob("escaped*")), list(lab.folder.rglob("escaped*"))
    lab.server.sql(f"UPDATE weft.part SET fabric = '{of_b[0]}' WHERE {number}'../escaped'")


def evaluated(lab, campaign, merged):
    """Leaving one rig out needs each fabric on two rigs: a fourth rig, with another tilt, records them all."""
    alone = lab.run("fabric", "evaluate", merged, "--exploration", "M1", "--group", "rig", "--leave-one-group-out", "--learner", "lda", "--json")
    assert alone.returncode == 1 and json.loads(alone.stdout)["error"]["code"] == "invalid argument", alone
    other = json.loads(lab.rigs["a"].rig.read_text())
    other["name"], other["simulation"]["rig_tilt_mrad"] = "z", 0.3
    (lab.folder / "z.json").write_text(json.dumps(other))
    ran = lab.run("run", lab.recipe, "--part", "1/1", "--rig", lab.folder / "z.json", "--out", lab.folder / "rig-z", "--no-evaluate", "--no-error-check")
    assert ran.returncode == 0, ran.stderr
    _, files = lab.fetch(campaign)
    told = lab.merge([*(file["file"] for file in files), lab.folder / "rig-z"], lab.folder / "both.h5")
    again = lab.merge([lab.folder / "rig-z", *(file["file"] for file in files[::-1])], lab.folder / "again.h5")
    assert told["trials"] == 2 * FABRICS * REPETITIONS * 2 and told["datasets"] == 2 * FABRICS, told
    assert again["trials"] == told["trials"], again
    ran = lab.run("fabric", "evaluate", lab.folder / "both.h5", "--exploration", "M1", "--group", "rig", "--leave-one-group-out", "--learner", "lda", "--json")
    assert ran.returncode == 0, ran.stderr
    found = json.loads(ran.stdout)
    assert found["bench"] == "simulated" and {group["group"] for group in found["groups"]} == {"a", "b", "c", "z"}, found
    # One rig twice, one fabric of one rig twice, and a fabric that no rig has.
    of_a = lab.folder / "one-rig-short"
    for inputs, code, where in (([of_a, of_a], "invalid argument", "one-rig-short"), ([of_a, lab.folder / "rig-z", lab.folder / "rig-z/0001-knitwear1"],
                                "invalid argument", "rig-z"), ([lab.folder / "rig-z/0001-knitwear1", of_a / "0001-knitwear1"], "not found", "denim")):
        ran = lab.run("dataset", "merge", "--by-rig", *inputs, "-o", lab.folder / "no.h5", "--json")
        error = json.loads(ran.stdout)["error"]
        assert ran.returncode == 1 and error["code"] == code and where in error["where"] and not (lab.folder / "no.h5").exists(), ran
    assert lab.merge([of_a, lab.folder / "rig-z"], lab.folder / "two-rigs.h5")["trials"] == told["trials"]
    print(f"SIMULATED: leave one rig out, LDA: {found['results']['lda']['accuracy']:.2f} of {told['trials'] // 2} trials", flush=True)


# Faults. Each starts while a rig is in a trial of a part, and returns what makes the laboratory whole again.


def moment_on(lab, rng, campaign):
    """A seeded rig in a trial, after a seeded wait within it."""
    names = list(lab.rigs)
    rng.shuffle(names)
    wait_s = rng.uniform(0, 0.8)
    time.sleep(wait_s)

    def busy():
        assert any(row[1] != "done" for row in lab.part_rows(campaign)), "the campaign ended before the fault"
        for name in names:
            if lab.rigs[name].in_a_trial():
                return lab.rigs[name]
        return None
    found = until(busy, "no rig in a trial")
    time.sleep(rng.uniform(0, 0.1))
    return found


def killed(lab, rng, campaign, way):
    """The daemon is killed and comes back, is gone until the end, or is ended by its service manager."""
    rig = moment_on(lab, rng, campaign)
    status = rig.end(signal.SIGTERM if way == "ended" else signal.SIGKILL)
    assert status == (0 if way == "ended" else -signal.SIGKILL), status
    if way == "back":
        time.sleep(rng.uniform(0, 2 * LEASE_S))
        rig.start()
        rig.look_after()
        rig.accept()
    lab.await_done(campaign)
    if way != "back":
        rig.start()
        rig.look_after()
    return rig


def restarted(lab, rng, campaign, mode):
    rig = moment_on(lab, rng, campaign)
    for _ in range(rng.randint(1, 2)):
        lab.server.call("pg_ctl", "-D", lab.server.data, "-w", "-m", mode, "stop")
        time.sleep(rng.uniform(0, 1.5 * LEASE_S))
        lab.server.start()
        time.sleep(rng.uniform(0, 0.5))
    lab.await_done(campaign)
    return rig


def withdrawn(lab, rng, campaign, way):
    expires, rig = way == "expiry", moment_on(lab, rng, campaign)
    held = rig.part()
    if expires:
        rig.client.call("lease.renew", lease=rig.lease, ttl_ms=1000)
        rig.lease = None
    else:
        rig.client.call("lab.withdraw")
    begun = len(rig.journal("lab.part_begun"))
    lab.await_done(campaign)
    status = rig.status()
    if held and expires:  # its lease is kept for the run, and ends with it
        until(lambda: rig.status()["accepted_by"] is None, lambda: rig.status(), 10)
    assert rig.status()["accepted_by"] is None, status
    rows = {row[0]: row for row in lab.part_rows(campaign)}
    if held:
        assert rows[held["fabric"]][2:] == (rig.name, str(held["attempt"])), (held, rows)  # it went on, and was finished
    if held and not expires:
        assert len(rig.journal("lab.part_begun")) == begun, rig.journal("lab.part_begun")
    return rig


def cut_off(lab, rng, campaign, how):
    """Longer than the lease: another rig takes the part; the late result is refused."""
    rig = moment_on(lab, rng, campaign)
    rig.pace(100)  # its run outlasts the lease of its part, or its end does
    held = rig.part()
    before = len(rig.journal("lab.part_lost"))
    stopped = []
    if how == "link":
        rig.cut_off()
    else:
        stopped = [int(pid) for pid in lab.server.sql(f"SELECT pid FROM pg_stat_activity WHERE usename = '{rig.login}'").split()]
        for pid in stopped:
            os.kill(pid, signal.SIGSTOP)
    if held and any(row[0] == held["fabric"] and row[1] == "done" for row in lab.part_rows(campaign)):
        held = None  # finished in the last moment
    try:
        lab.await_done(campaign)
        rig.pace(PACE)
        until(lambda: not rig.client.call("rig.state").get("run") and not rig.in_a_trial(), lambda: (rig.status(), rig.client.call("rig.state")))
    finally:
        for pid in stopped:
            with contextlib.suppress(ProcessLookupError):
                os.kill(pid, signal.SIGCONT)
        if how == "link":
            rig.join()
    lab.settled(rig)
    if held:
        rows = {row[0]: row for row in lab.part_rows(campaign)}
        assert rows[held["fabric"]][2] != rig.name and int(rows[held["fabric"]][3]) > held["attempt"], (held, rows)
        lost = rig.journal("lab.part_lost")
        assert len(lost) == before + 1, (held, lost)
    return rig


FAULTS = [(killed, ("ended", "gone", "back")), (restarted, ("fast", "immediate")), (withdrawn, ("order", "expiry")), (cut_off, ("link", "stop"))]


def faults(lab, seeds, only=None):
    for seed in seeds:
        for number, (fault, ways) in enumerate(FAULTS):
            if only and fault.__name__ not in only:
                continue
            way = ways[(seed + number) % len(ways)]
            for rig in lab.rigs.values():
                rig.pace(PACE)
                rig.accept()
            began = time.monotonic()
            campaign = lab.submit(lab.disturbed)
            rig = fault(lab, random.Random(f"{seed} {fault.__name__}"), campaign, way)
            parts, _ = lab.check(campaign, lab.disturbed)
            for each in lab.rigs.values():
                each.withdraw()
            print(f"SIMULATED: seed {seed}: {fault.__name__} ({way}) on {rig.name}: {sum(part['attempt'] for part in parts)} attempts of {len(parts)} parts, "
                  f"{time.monotonic() - began:.1f} s", flush=True)


def without_the_store(lab):
    """A rig that has never reached its store works alone, and publishes all when the store is there, once."""
    rig = Rig(lab, "d", is_joined=False).start()
    first = rig.alone()
    first_ended_us = time.time() * 1e6
    status = rig.status()
    assert not status["is_connected"] and status["error"] and status["unpublished"] == 1 and status["reached_us"] is None, status
    assert rig.end() == 0
    time.sleep(1)
    rig.start()
    assert rig.status()["unpublished"] == 1, rig.status()
    second = rig.alone()
    assert rig.status()["unpublished"] == 2, rig.status()
    rig.join()
    lab.settled(rig)
    assert set(rig.runs()) == {first, second}
    listed = {run["run"]: run for run in lab.command("runs", "--rig", "d", uri=lab.uri("reader"))["runs"]}
    assert abs(listed[first]["ended_us"] - first_ended_us) < 1e6 and listed[first]["ended_us"] < listed[second]["started_us"], listed
    assert lab.server.sql("SELECT count(*), count(DISTINCT d.dataset_sha256) FROM weft.dataset d JOIN weft.run r ON r.id = d.run_id WHERE r.rig = 'd'") == "2|2"
    # A restart repeats nothing that the store has.
    before = lab.server.sql("SELECT run, revision, xmin FROM weft.run WHERE rig = 'd' ORDER BY run")
    seen = lab.server.sql("SELECT seen_at FROM weft.rig WHERE name = 'd'")
    assert rig.end() == 0
    rig.start()
    until(lambda: lab.server.sql("SELECT seen_at FROM weft.rig WHERE name = 'd'") != seen, rig.status, 30)
    lab.settled(rig)
    assert lab.server.sql("SELECT run, revision, xmin FROM weft.run WHERE rig = 'd' ORDER BY run") == before
    # A read-only store refuses publications for now, not for good.
    lab.server.sql("ALTER ROLE rig_d SET default_transaction_read_only = on; SELECT pg_terminate_backend(pid) FROM pg_stat_activity WHERE usename = 'rig_d'")
    third = rig.alone()
    until(lambda: "25006" in (rig.status()["error"] or ""), rig.status, 30)
    assert rig.status()["unpublished"] == 1, rig.status()
    lab.server.sql("ALTER ROLE rig_d RESET default_transaction_read_only; SELECT pg_terminate_backend(pid) FROM pg_stat_activity WHERE usename = 'rig_d'")
    lab.settled(rig)
    assert third in {run["run"] for run in lab.command("runs", "--rig", "d", uri=lab.uri("reader"))["runs"]}
    # A store that was made anew receives all runs again.
    of_d = "USING weft.run r WHERE r.id = run_id AND r.rig = 'd'"
    lab.server.sql(f"DELETE FROM weft.trial {of_d}; DELETE FROM weft.certificate {of_d}; DELETE FROM weft.dataset {of_d}; DELETE FROM weft.run WHERE rig = 'd'; "
                   "UPDATE weft.store SET id = gen_random_uuid(); SELECT pg_terminate_backend(pid) FROM pg_stat_activity WHERE usename = 'rig_d'")
    until(lambda: {run["run"] for run in lab.command("runs", "--rig", "d", uri=lab.uri("reader"))["runs"]} == {first, second, third}, rig.status, 30)
    lab.settled(rig)
    assert lab.server.sql("SELECT count(*) FROM weft.dataset d JOIN weft.run r ON r.id = d.run_id WHERE r.rig = 'd'") == "3"
    assert rig.end() == 0
    # No token goes to an address in the clear, whatever the store states.
    digest = lab.server.sql("SELECT d.dataset_sha256 FROM weft.dataset d JOIN weft.run r ON r.id = d.run_id WHERE r.rig = 'd' LIMIT 1")
    lab.server.sql("UPDATE weft.dataset d SET place = '/nowhere' || d.place FROM weft.run r WHERE r.id = d.run_id AND r.rig = 'd'")
    for address in ("http://192.0.2.1:1", "http://127.0.0.1:1@192.0.2.1:1"):
        lab.server.sql(f"UPDATE weft.rig SET status = jsonb_build_object('http', '{address}') WHERE name = 'd'")
        error = lab.command("fetch", digest, "--out", lab.folder / "clear", uri=lab.uri("reader"), expect=1, env=lab.tokens("d", "wft_any"))["error"]
        assert error["code"] == "invalid argument" and error["got"] == address, error
    print("SIMULATED: a rig without its store publishes later", flush=True)


def given_back(lab):
    """A person stops the run of a part: another rig records it. A recipe that fits no rig is refused once by each."""
    a, b = lab.rigs["a"], lab.rigs["b"]
    a.pace(100)
    a.accept()
    campaign = lab.submit(lab.single, rigs="a,b")
    run = until(a.in_a_trial, a.status)["run"]
    a.client.call("run.stop", run=run)
    until(lambda: lab.part_rows(campaign)[0][1:] == ("queued", "a", "1"), lambda: lab.part_rows(campaign))
    assert a.status()["accepted_by"] is None, a.status()
    b.accept()
    lab.await_done(campaign)
    parts, _ = lab.check(campaign, lab.single)
    assert [(part["rig"], part["attempt"]) for part in parts] == [("b", 2)], parts
    recipe = json.loads(lab.single.read_text())
    recipe["name"] = "fast"
    for exploration in recipe["explorations"].values():
        exploration["phases"][2]["speed_mm_s"] = 90
    a.accept()
    campaign = lab.submit(lab.write_recipe(recipe), rigs="a,b")
    for rig in (a, b):
        until(lambda: any(line["data"]["campaign"] == campaign for line in rig.journal("lab.part_refused")), rig.status, 20)
    attempts = int(lab.part_rows(campaign)[0][3])
    time.sleep(7)
    assert lab.part_rows(campaign)[0][1] == "queued" and int(lab.part_rows(campaign)[0][3]) <= max(attempts, 2), lab.part_rows(campaign)
    lab.command("cancel", campaign, uri=lab.uri("submit"))
    a.withdraw(), b.withdraw()
    print("SIMULATED: parts that a person stops or that fit no rig are given back", flush=True)


def finished_late(lab):
    """The run of a part ends without the store, then the daemon dies: after its restart it still finishes the part, which no other rig could take."""
    a = lab.rigs["a"]
    a.pace(100)
    a.accept()
    campaign = lab.submit(lab.single, rigs="a")
    run = until(a.in_a_trial, a.status)["run"]
    a.cut_off()
    a.pace(PACE)
    assert a.client.call("run.wait", run=run)["outcome"] == "complete"
    a.end(signal.SIGKILL)
    until(lambda: lab.campaign(campaign)["parts"][0]["lease_expired"], lambda: lab.campaign(campaign), 20)
    a.join()
    a.start()
    lab.await_done(campaign)
    parts, _ = lab.check(campaign, lab.single)
    assert [(part["rig"], part["attempt"], part["run"]) for part in parts] == [("a", 1, run)], parts
    print("SIMULATED: a part is finished after an outage and a restart", flush=True)


def rights(lab):
    """Readers, rigs and people do only what is theirs."""
    a, b = lab.rigs["a"], lab.rigs["b"]
    a.withdraw(), b.withdraw()
    error = lab.command("submit", lab.recipe, "--rigs", "a", uri=lab.uri("reader"), expect=1)["error"]
    assert error["code"] == "wrong state" and "42501" in error["got"], error
    error = lab.command("submit", lab.recipe, "--rigs", "a", uri=lab.uri("rig_a"), expect=1)["error"]
    assert error["code"] == "wrong state" and "42501" in error["got"], error
    # Only the holder of the rig's lease accepts.
    error = a.client.refused("lab.accept")
    assert error["data"]["kind"] == "param.missing" and error["code"] == -32602, error
    error = a.client.refused("lab.accept", lease="L-00000000-1")
    assert error["data"]["kind"] == "lease.required" and error["code"] == LEASE_REQUIRED, error
    other = Client(("127.0.0.1", a.daemon.port), introduce=False)
    other.call("session.open", client="other", token=a.token)
    theirs = other.call("lease.acquire", ttl_ms=600_000)["lease"]
    error = a.client.refused("lease.acquire", ttl_ms=1000)
    assert error["data"]["kind"] == "state.conflict", error
    assert a.client.refused("lab.accept", lease=theirs)["data"]["kind"] == "lease.required"
    assert other.call("lab.accept", lease=theirs)["accepted_by"] == "token:bo"
    other.call("lab.withdraw")
    # An accepting user who loses the lease to another takes no further part.
    other.call("lease.release", lease=theirs)
    a.accept()
    a.release()
    theirs = other.call("lease.acquire", ttl_ms=600_000)["lease"]
    until(lambda: a.status()["accepted_by"] is None, a.status, 5)
    other.call("lease.release", lease=theirs)
    # A new lease of the same user is not the one that accepted.
    a.accept()
    a.release()
    a.hold(600_000)
    until(lambda: a.status()["accepted_by"] is None, a.status, 5)
    campaign = lab.submit(rigs="a")
    time.sleep(3)
    assert {row[1:] for row in lab.part_rows(campaign)} == {("queued", "", "0")}, lab.part_rows(campaign)
    lab.command("cancel", campaign, uri=lab.uri("submit"))
    a.release()
    # A submitter's login is no way to write files on a rig.
    number = lab.sql_of("submit", f"SELECT weft.submit_campaign('../../../escaped', '{{}}', repeat('a', 64), 1, '{{}}', '{{velvet}}', '{{a}}', NULL)")
    a.accept()
    until(lambda: [line for line in a.journal("lab.part_refused") if line["data"]["campaign"] == f"C-{int(number):06}"], a.status, 20)
    assert not list(lab.folder.rglob("escaped*")), list(lab.folder.rglob("escaped*"))
    until(lambda: a.part() is None, a.status, 20)
    time.sleep(2)
    assert len([line for line in a.journal("lab.part_refused") if line["data"]["campaign"] == f"C-{int(number):06}"]) == 1
    lab.command("cancel", number, uri=lab.uri("submit"))
    a.withdraw()
    # Two daemons with each other's login publish nothing, and work alone.
    runs = lab.server.sql("SELECT count(*) FROM weft.run")
    for rig, login in ((a, "rig_b"), (b, "rig_a")):
        assert rig.end() == 0
        rig.start(login=login)
    for rig in (a, b):
        until(lambda: "42501" in (rig.status()["error"] or ""), rig.status, 20)
        rig.alone()
        assert rig.status()["unpublished"] == 1 and "42501" in rig.status()["error"], rig.status()
    assert lab.server.sql("SELECT count(*) FROM weft.run") == runs
    for rig, login in ((a, "rig_a"), (b, "reader")):
        assert rig.end() == 0
        rig.start(login=login)
    lab.settled(a)
    until(lambda: "42501" in (b.status()["error"] or ""), b.status, 20)
    b.accept()  # its login can take no part
    campaign = lab.submit(rigs="b")
    time.sleep(3)
    assert {row[1] for row in lab.part_rows(campaign)} == {"queued"} and b.part() is None, lab.part_rows(campaign)
    lab.command("cancel", campaign, uri=lab.uri("submit"))
    assert b.end() == 0
    b.start()
    lab.settled(b)
    print("SIMULATED: rights of readers, rigs and people as expected", flush=True)


def secrets(lab, watch):
    """No password and no token of a part in what the programs wrote, but the part that a rig holds now in its own database."""
    given = set(lab.server.sql("SELECT encode(token_sha256, 'hex') FROM public.given").split())
    assert len(given) > FABRICS
    texts = {"weft": lab.said}
    for rig in lab.rigs.values():
        if rig.daemon.process.poll() is None:
            texts[f"{rig.name}: journal"] = json.dumps([line for line in pages_of_journal(rig)])
            texts[f"{rig.name}: status"] = json.dumps([rig.status(), rig.client.call("lab.rigs")])
            assert rig.end() == 0
        texts[f"{rig.name}: output"] = rig.said
        for file in rig.folder.rglob("*"):
            if file.is_file():
                texts[str(file)] = file.read_bytes().decode("latin-1")
    texts["server"] = lab.server.log()
    for place, text in texts.items():
        assert not any(password_of(login) in text for login in lab.logins), place
        if place != "server" and not place.endswith(("weftd.sqlite", "weftd.sqlite-wal")):
            assert not tokens_in(text, given), place
    assert any(tokens_in(text, given) for place, text in texts.items() if place == "server"), "the search for tokens finds none where they are"
    watch.ended.set()
    watch.join()
    assert not watch.found and watch.looks > 10, (watch.found, watch.looks)


def pages_of_journal(rig):
    cursor = {}
    while True:
        page = rig.client.call("log.query", most=1000, **cursor)
        yield from page["lines"]
        if not page.get("next"):
            return
        cursor = {"from": page["next"]}


def tokens_in(text, given):
    return {one for one in set(re.findall("[0-9a-f]{64}", text)) if hashlib.sha256(one.encode()).hexdigest() in given}


def whole(lab, rounds):
    """The campaign of the paper over three rigs; then with a rig killed and the store restarted in the middle."""
    recipe = lab.root / "recipes/library/khan2016.json"
    lab.reference(recipe)
    for number in range(rounds):
        for rig in lab.rigs.values():
            rig.pace(0)
            rig.accept()
        began, rng = time.monotonic(), random.Random(number)
        campaign = lab.submit(recipe)
        if number > 0:
            done = rng.randrange(10)  # of 17 parts; a number of seconds would depend on the machine
            until(lambda: sum(row[1] == "done" for row in lab.part_rows(campaign)) >= done, lambda: lab.part_rows(campaign))
            killed_rig = rng.choice(list(lab.rigs.values()))
            until(killed_rig.in_a_trial, killed_rig.status)
            killed_rig.end(signal.SIGKILL)
            time.sleep(rng.uniform(0, 3))
            lab.server.call("pg_ctl", "-D", lab.server.data, "-w", "-m", rng.choice(["fast", "immediate"]), "-l", lab.server.folder / "log", "restart")
            killed_rig.start(pace=0)
            killed_rig.look_after()
            killed_rig.accept()
        lab.await_done(campaign, 1800)
        lasted = time.monotonic() - began
        parts, merged = lab.check(campaign, recipe)
        print(f"SIMULATED: khan2016, {len(parts)} parts over three rigs{' with a kill and a restart' if number else ''}: {lasted:.1f} s, "
              f"{sum(part['attempt'] for part in parts)} attempts, {merged.stat().st_size / 1e6:.0f} MB", flush=True)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("weft", type=pathlib.Path)
    parser.add_argument("weftd", type=pathlib.Path)
    parser.add_argument("root", type=pathlib.Path)
    parser.add_argument("--seeds", type=int, default=2)
    parser.add_argument("--first", type=int, default=1)
    parser.add_argument("--repetitions", type=int, default=1)
    parser.add_argument("--only", default="")
    parser.add_argument("--whole", action="store_true")
    args = parser.parse_args()
    if lab_support.programs() is None:
        print(lab_support.NOT_INSTALLED)
        sys.exit(77)
    with lab_support.Server() as server, tempfile.TemporaryDirectory(prefix="weft-rigs-") as folder:
        lab = Lab(args.weft.resolve(), args.weftd.resolve(), args.root.resolve(), pathlib.Path(folder).resolve(), server, args.repetitions)
        try:
            watch = CommandLines(lambda text: any(password_of(login) in text for login in lab.logins))
            watch.start()
            for name in "abc":
                Rig(lab, name).start().await_published()
            if args.whole:
                return whole(lab, 1 + args.seeds)
            plain_campaign(lab)
            for rig in lab.rigs.values():
                rig.withdraw()
            faults(lab, range(args.first, args.first + args.seeds), args.only.split(",") if args.only else None)
            given_back(lab)
            finished_late(lab)
            rights(lab)
            without_the_store(lab)
            secrets(lab, watch)
        finally:
            for rig in lab.rigs.values():
                if rig.daemon.process.poll() is None:
                    rig.daemon.process.kill()
                    rig.daemon.process.wait()


if __name__ == "__main__":
    main()
