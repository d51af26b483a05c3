#!/usr/bin/env python3
"""`weft run --part` and `weft dataset merge`: any number of parts merges to the same bytes; wrong, missing and killed parts. SIMULATED.

    parts.py WEFT SOURCE_ROOT
"""
import hashlib
import json
import pathlib
import random
import shutil
import signal
import sqlite3
import subprocess
import sys
import tempfile
import time

from campaign_support import RUN, complete, read_only
from cli_support import Checks

REPETITIONS = 3
EACH, ALL = 2 * REPETITIONS, 10 * REPETITIONS  # trials of a fabric and of the recipe
FABRICS = ["denim", "silk", "fleece", "corduroy", "satin"]
KILL_SEED, KILLS, PATIENCE_S = 51, 5, 60
LONG_S = 200  # duration of phase S in bench time: a trial that can be killed in its middle takes some tenths of a second here


def phases(rest_s, path):
    band = {"force_N": 5, "force_band_N": 0.25}
    return {"phases": [{"phase": "S", "duration_s": rest_s}, {"phase": "P", **band, "duration_s": 2},
                       {"phase": "M", **band, "speed_mm_s": 2, "path": path}, {"phase": "E", "duration_s": 1}]}


def write_recipe(file, order="blocked", fabrics=FABRICS, repetitions=REPETITIONS, rest_s=1, both=True):
    explorations = {"M1": phases(rest_s, [{"dx_mm": 0, "dy_mm": 6}])}
    if both:
        explorations["M2"] = phases(rest_s, [{"dx_mm": 0, "dy_mm": 4}, {"dx_mm": 4, "dy_mm": 0}])
    file.write_text(json.dumps({"schema_version": 1, "name": "parts", "seed": 7, "fabrics": fabrics, "repetitions": repetitions,
                                "order": {"kind": order}, "explorations": explorations}))


def sha256(file):
    return hashlib.sha256(file.read_bytes()).hexdigest()


def part_json(folder):
    return json.loads((folder / "part.json").read_text())


class Bench:
    """The simulated bench, in a scratch folder."""

    def __init__(self, t, d, root):
        self.t, self.d, self.rig = t, d, root / "sim/rigs/bench17.json"

    def write_rig(self, name, change, source=None):
        """A changed copy of a rig file, of the simulated bench by default."""
        source = source or self.rig
        rig = json.loads(source.read_text())
        for table in {"fabrics", "fidelity"} & rig["simulation"].keys():
            rig["simulation"][table] = str((source.parent / rig["simulation"][table]).resolve())
        change(rig)
        (self.d / name).write_text(json.dumps(rig))

    def command(self, recipe, out, part, *more, rig=None):
        return ["run", recipe, "--rig", str(rig or self.rig), "--out", out, *RUN, "--part", part, *more]

    def part(self, recipe, out, part, *more, rig=None):
        ran = self.t.run(*self.command(recipe, out, part, *more, rig=rig), "--json", cwd=self.d)
        self.t.expect(ran.returncode == 0, f"{out}: part {part}: {ran.returncode} {ran.stderr}")
        return json.loads(ran.stdout) if ran.returncode == 0 else {}

    def parts(self, recipe, name, count, *more):
        folders = [f"{name}-{k}of{count}" for k in range(1, count + 1)]
        for k, folder in enumerate(folders, 1):
            ended = self.part(recipe, folder, f"{k}/{count}", *more)
            self.t.expect(ended.get("is_complete") is True and ended.get("bench") == "simulated" and ended.get("part") == f"{k}/{count}", f"{ended}")
        return folders

    def merge(self, folders, out):
        return self.t.succeeds("dataset", "merge", *folders, "-o", out, cwd=self.d)

    def refuses_merge(self, *inputs, **error):
        return self.t.refuses("dataset", "merge", *inputs, "-o", "refused.h5", cwd=self.d, **error)


def same_whatever_the_number(bench, recipe, name, fabrics, trials):
    """Merged sets of 1, 2, 3 and 7 parts, in two orders of the parts, have one digest and the same bytes."""
    t, seen = bench.t, set()
    for count in (1, 2, 3, 7):
        folders = bench.parts(recipe, name, count)
        for order, inputs in (("", folders), ("r", folders[::-1]))[:1 if count == 1 else 2]:
            file = f"{name}-{count}{order}.h5"
            merged = bench.merge(inputs, file)
            t.expect((merged["trials"], merged["datasets"], merged["bench"]) == (trials, len(fabrics), "simulated"), f"{file}: {merged}")
            seen.add((merged["dataset_sha256"], sha256(bench.d / file)))
        lists = [part_json(bench.d / folder) for folder in folders]
        t.expect([(one["format"], one["version"], one["part"], one["parts"], one["bench"]) for one in lists]
                 == [("weft-part", 1, k, count, "simulated") for k in range(1, count + 1)], f"{name}: part.json: {lists}")
        for k, one in enumerate(lists):
            t.expect([c["fabric"] for c in one["campaigns"]] == fabrics[k::count], f"{name}: fabrics of part {k + 1}/{count}: {one}")
            t.expect([c["folder"] for c in one["campaigns"]] == [f"{fabrics.index(c['fabric']) + 1:04}-{c['fabric']}" for c in one["campaigns"]],
                     f"{name}: folders of part {k + 1}/{count}: {one}")
    t.expect(len(seen) == 1, f"{name}: the number of parts changes the digest or the bytes: {seen}")


def plan_order(bench):
    """A merged set has the trials of a plain run, in its order."""
    for name in ("blocked", "randomised"):
        ran = bench.t.run("run", f"{name}.json", "--rig", bench.rig, "--out", f"plain-{name}", *RUN, cwd=bench.d)
        bench.t.expect(ran.returncode == 0, f"plain {name}: {ran.stderr}")
    try:
        import h5py
    except ImportError:
        return print("h5py is not installed: the trials of merged sets were not compared with those of a plain run")

    def trials(file):
        with h5py.File(bench.d / file, "r") as h5:
            columns = [h5[f"trials/{name}"][:] for name in ("file", "label", "exploration", "repetition", "index", "patch_seed", "sha256")]
        return list(zip(*(column.tolist() for column in columns)))
    for name in ("blocked", "randomised"):
        plain, merged = trials(f"plain-{name}/dataset.h5"), trials(f"{name}-3.h5")
        bench.t.expect([one[:-1] for one in plain] == [one[:-1] for one in merged], f"{name}: trials or their order differ from a plain run")
    plain, merged = trials("plain-blocked/dataset.h5"), trials("blocked-3.h5")
    first = [one for one in plain if one[1].decode() == FABRICS[0]]
    bench.t.expect(len(first) == EACH and first == merged[:EACH], f"the first fabric differs from a plain run: {first}, {merged[:EACH]}")
    bench.t.expect(plain[EACH][-1] != merged[EACH][-1], "the second fabric of a plain run begins on a used bench: the comparison above compares nothing")


def first_fabric(bench):
    """The trials of the first fabric are those of a plain run: digests in the certificates."""
    def digests(folder):
        trials = json.loads((bench.d / folder / "certificate.json").read_text())["trials"]
        return [(one["name"], one["sha256"]) for one in trials if f"-{FABRICS[0]}-" in one["name"]]
    plain, part = digests("plain-blocked"), digests(f"blocked-1of3/0001-{FABRICS[0]}")
    bench.t.expect(len(plain) == EACH and plain == part, f"{plain} is not {part}")


def merged_file_opens(bench):
    t, d = bench.t, bench.d
    info = t.succeeds("dataset", "info", "blocked-3.h5", cwd=d)
    digest = info["dataset_sha256"]
    t.expect((info["bench"], info["trials"], sorted(info["labels"]), info["seed"]) == ("simulated", ALL, sorted(FABRICS), 7), f"info: {info}")
    seen = t.succeeds("verify", "blocked-3.h5", cwd=d)
    t.expect(seen["holds"] and seen["dataset_sha256"] == digest and (seen["trials_complete"], seen["trials_planned"]) == (ALL, ALL), f"verify: {seen}")
    found = t.succeeds("fabric", "evaluate", "blocked-3.h5", "--exploration", "M1", "--leave-one-group-out", "--learner", "lda", cwd=d)
    t.expect(found["bench"] == "simulated" and found["command"] == "evaluate", f"evaluate: {found}")


def wrong_parts(bench):
    t, d, three, two = bench.t, bench.d, [f"blocked-{k}of3" for k in (1, 2, 3)], [f"blocked-{k}of2" for k in (1, 2)]
    bench.refuses_merge(three[0], three[2], code="not found", where="part 2/3", expected="3", got="2")
    bench.refuses_merge(three[0], code="not found", where="part 2/3, part 3/3")
    bench.refuses_merge(*three, three[1], code="invalid argument", where=three[1], says=["part 2/3"])
    shutil.copytree(d / three[1], d / "copy")
    bench.refuses_merge(*three, "copy", code="invalid argument", where="copy", got=three[1], says=["part 2/3"])
    bench.refuses_merge(two[0], three[1], code="invalid argument", where=three[1], expected="2", got="3")
    campaigns = [f"{folder}/{one['folder']}" for folder in three for one in part_json(d / folder)["campaigns"]]
    t.expect(bench.merge(campaigns, "campaigns.h5")["datasets"] == 5 and sha256(d / "campaigns.h5") == sha256(d / "blocked-1.h5"), "folders of campaigns")
    files = [f"{folder}/dataset.h5" for folder in campaigns]
    bench.merge(files, "files.h5")
    t.expect(sha256(d / "files.h5") == sha256(d / "blocked-1.h5"), "files of campaigns")
    without = [name for name in campaigns if not name.endswith("fleece")]
    bench.refuses_merge(*without, code="not found", where=["fleece", str(EACH)], expected=str(ALL), got=str(ALL - EACH))
    bench.refuses_merge(*campaigns, "copy/0002-silk", code="invalid argument", where=["copy/0002-silk"], says=["fabric silk"])
    bench.refuses_merge(*three, "blocked-1of1/0005-satin", code="invalid argument", where=["blocked-1of1/0005-satin"], says=["fabric satin"])
    bench.refuses_merge("nowhere", code="not found", where=["nowhere"])
    shutil.rmtree(d / "copy")


def other_conditions(bench, root):
    """Parts of another recipe, seed or rig; parts that were altered, are unfinished or empty."""
    t, d, one = bench.t, bench.d, "blocked-1of2"
    bench.write_rig("other-rig.json", lambda rig: rig["devices"][0]["emulator"].update(serial=45000099))
    bench.part("blocked.json", "seed-2of2", "2/2", "--seed", "8")
    bench.part("blocked.json", "rig-2of2", "2/2", rig="other-rig.json")
    write_recipe(d / "other.json", repetitions=2)
    bench.part("other.json", "recipe-2of2", "2/2")
    bench.refuses_merge(one, "seed-2of2", code="invalid argument", where=["seed-2of2/0002-silk"], expected="7", got="8")
    bench.refuses_merge(one, "rig-2of2", code="invalid argument", where=["rig-2of2/0002-silk"], says=["rig"])
    bench.refuses_merge(one, "recipe-2of2", code="invalid argument", where=["recipe-2of2/0002-silk"], says=["recipe"])
    shutil.copytree(d / "blocked-2of2", d / "swapped")
    shutil.copy(d / "seed-2of2/0002-silk/dataset.h5", d / "swapped/0002-silk/dataset.h5")
    bench.refuses_merge(one, "swapped", code="corrupt", where=["swapped/0002-silk/dataset.h5"])
    shutil.copytree(d / "blocked-2of2", d / "flipped")
    file = d / "flipped/0002-silk/dataset.h5"
    data = bytearray(file.read_bytes())
    data[len(data) // 2] ^= 1
    file.write_bytes(data)
    bench.refuses_merge(one, "flipped", code="corrupt", where=["flipped/0002-silk/dataset.h5"])
    shutil.copytree(d / "blocked-2of2", d / "unlisted")
    (d / "unlisted/part.json").unlink()
    bench.refuses_merge(one, "unlisted", code="not found", where="unlisted")
    for name, change, code in (("version", {"version": 2}, "unsupported"), ("keys", {"campaigns": 3}, "parse"), ("none", {"parts": 0}, "parse"),
                               ("negative", {"parts": -1}, "parse"), ("beyond", {"part": 3}, "parse")):
        shutil.copytree(d / "blocked-2of2", d / name)
        (d / name / "part.json").write_text(json.dumps({**part_json(d / name), **change}))
        bench.refuses_merge(one, name, code=code, where=f"{name}/part.json")
    bench.refuses_merge("blocked-6of7", code="not found", where=["2/7"])


def merge_keeps_inputs(bench):
    """The output is never a file of an input, by whatever name; nor can a merged set lose its rigs, or its bench be altered."""
    t, d, parts = bench.t, bench.d, []
    for k in (1, 2):
        shutil.copytree(d / f"blocked-{k}of2", d / f"inputs{k}")
        parts.append(f"inputs{k}")
    data = d / "inputs1/0001-denim/dataset.h5"
    before = [sha256(file) for file in (data, d / "inputs1/part.json")]
    (d / "link.h5").symlink_to(data)
    for out in ("inputs1/0001-denim/dataset.h5", "inputs1/part.json", "link.h5"):
        t.refuses("dataset", "merge", *parts, "-o", out, cwd=d, code="invalid argument", where=out)
    t.expect([sha256(file) for file in (data, d / "inputs1/part.json")] == before, "a merge replaces a file of its input")
    t.succeeds("dataset", "merge", *parts, "-o", "by-rig.h5", "--by-rig", cwd=d)
    t.refuses("dataset", "merge", "by-rig.h5", "-o", "refused.h5", "--by-rig", cwd=d, code="unsupported", where=["by-rig.h5"])
    try:
        import h5py
        import numpy
    except ImportError:
        return print("h5py is not installed: no part with an altered bench was merged")
    shutil.copytree(d / "blocked-1of1", d / "inputs-one")
    for one in (d / "inputs-one").glob("0*/dataset.h5"):
        with h5py.File(one, "r+") as h5:
            h5.attrs.modify("bench_kind", numpy.array(b"real", dtype=h5.attrs.get_id("bench_kind").dtype))
    bench.refuses_merge("inputs-one", code="corrupt", where=["dataset_sha256"])


def few_open_files(bench):
    """A merge has few of its data sets open, however many there are."""
    limited = f"ulimit -n 26 && exec '{bench.t.weft}' dataset merge many -o many.h5"
    write_recipe(bench.d / "many.json", order="randomised", fabrics=json.loads(bench.rig.read_text())["fabrics"][:24], repetitions=1, both=False)
    bench.part("many.json", "many", "1/1")
    ran = subprocess.run(["sh", "-c", limited], cwd=bench.d, capture_output=True, text=True)
    bench.t.expect(ran.returncode == 0, f"merge with 26 open files: {ran.returncode} {ran.stderr}")


def run_refusals(bench, root):
    t, d = bench.t, bench.d

    def refuses(part, *more, rig=None, **error):
        t.refuses(*bench.command("blocked.json", "no", part, *more, rig=rig), cwd=d, **error)
    for wrong in ("0/3", "4/3", "2", "1/0", "a/b", "1/2000000"):
        refuses(wrong, code="invalid argument", where="--part", got=wrong)
    for option in (["--socket", "s"], ["--beside", "."], ["--resume", "--preview"]):
        refuses("1/2", *option, code="invalid argument", where=option[-1] if option[-1] == "--preview" else option[0])
    refuses("1/2", "--budget", "100x", code="unsupported", where="--budget")
    emulated = root / "sim/rigs/emulated17.json"
    bench.write_rig("emulated.json", lambda rig: None, emulated)
    refuses("1/2", "--yes", rig="emulated.json", code="unsupported", where="emulated.json", expected="simulated")

    def to_real(rig):
        rig["bench"] = "real"
        del rig["simulation"]
        for device in rig["devices"]:
            del device["emulator"]
    bench.write_rig("real.json", to_real, emulated)
    refuses("1/2", "--yes", rig="real.json", code="unsupported", where="real.json", expected="simulated", got="real")


def open_trials(folder):
    """Whether a trial has begun and has not ended; None while the file is not readable yet."""
    if not (folder / "campaign.sqlite").exists():
        return None
    database = read_only(folder)
    try:
        return database.execute("SELECT count(*) FROM trial WHERE outcome IS NULL").fetchone()[0]
    except sqlite3.OperationalError:
        return None
    finally:
        database.close()


def killed_in_trial(bench, out, folder, trials, later_s):
    """Kills a part `later_s` after the trial that follows `trials` complete ones has begun. Whether that trial was then open."""
    process = subprocess.Popen([bench.t.weft, *bench.command("long.json", out, "1/1")], cwd=bench.d, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    place, end = bench.d / out / folder, time.monotonic() + PATIENCE_S
    while process.poll() is None and time.monotonic() < end and not (complete(place) == trials and open_trials(place)):
        time.sleep(0.002)
    time.sleep(later_s)
    process.send_signal(signal.SIGKILL)
    process.wait(PATIENCE_S)
    return process.returncode == -signal.SIGKILL and complete(place) == trials and open_trials(place) == 1


def killed(bench):
    """SIGKILL in a trial at seeded moments; the part is continued to the same digest."""
    t, d = bench.t, bench.d
    write_recipe(d / "long.json", fabrics=["denim", "silk"], repetitions=2, rest_s=LONG_S, both=False)
    bench.part("long.json", "undisturbed", "1/1")
    expected = bench.merge(["undisturbed"], "undisturbed.h5")["dataset_sha256"]
    moments, hits = random.Random(KILL_SEED), 0
    for number in range(KILLS):
        for attempt in range(6):  # a busy machine may be late
            out = f"killed-{number}-{attempt}"
            moment = moments.choice(["0001-denim", "0002-silk"]), moments.randrange(2), moments.uniform(0, 0.06)
            if killed_in_trial(bench, out, *moment):
                hits += 1
                break
            shutil.rmtree(d / out, ignore_errors=True)
        else:
            t.expect(False, f"kill {number}: never in a trial")
            continue
        t.expect(json.loads((d / out / "part.json").read_text())["is_complete"] is False, f"{out} {moment}: part.json of an unfinished part")
        bench.refuses_merge(out, code="not found", where=out)
        t.expect(t.run(*bench.command("long.json", out, "1/1"), cwd=d).returncode == 1, f"{out}: continued without --resume")
        resumed = bench.part("long.json", out, "1/1", "--resume")
        t.expect(resumed.get("is_complete") and [one["trials"] for one in resumed["campaigns"]] == [2, 2], f"{out} {moment}: {resumed}")
        merged = bench.merge([out], f"{out}.h5")
        t.expect(merged["trials"] == 4, f"{out} {moment}: {merged}")
        t.expect(samples_of(d / f"{out}.h5") == samples_of(d / "undisturbed.h5"), f"{out} {moment}: samples differ")
        t.expect(merged["dataset_sha256"] == expected, f"{out} {moment}: digest {merged['dataset_sha256']} is not that of an undisturbed part, {expected}")
    t.expect(hits == KILLS, f"{hits} of {KILLS} kills in a trial")


def samples_of(file):
    """All samples of a data set and the names of its trials without their attempts; None without h5py."""
    try:
        import h5py
    except ImportError:
        return None
    with h5py.File(file, "r") as h5:
        return [h5[name][:].tobytes() for name in ("taxel/counts", "taxel/t_ns", "taxel/phase", "wrench/quanta", "wrench/t_ns", "stages/quanta",
                                                   "trials/label", "trials/repetition", "trials/patch_seed")]


def killed_between_fabrics(bench):
    """The next fabric has no folder yet, an empty one, or one with an empty campaign file."""
    for name in ("none", "folder", "file"):
        out = bench.d / f"between-{name}"
        shutil.copytree(bench.d / "undisturbed", out)
        (out / "part.json").unlink()
        shutil.rmtree(out / "0002-silk")
        if name != "none":
            (out / "0002-silk").mkdir()
        if name == "file":
            (out / "0002-silk/campaign.sqlite").touch()
        bench.part("long.json", out.name, "1/1", "--resume")
        bench.merge([out.name], f"{out.name}.h5")
        bench.t.expect(sha256(bench.d / f"{out.name}.h5") == sha256(bench.d / "undisturbed.h5"), f"{name}: another merged set")


def resumed_as_another(bench):
    """A folder belongs to one part of one recipe."""
    t, d = bench.t, bench.d
    before = (d / "blocked-1of2/part.json").read_bytes()

    def refused(what, recipe, out, part, *more, rig=None):
        ran = t.run(*bench.command(recipe, out, part, *more, rig=rig), "--json", cwd=d)
        t.expect(ran.returncode == 1 and json.loads(ran.stdout or "{}").get("error", {}).get("code") == "wrong state",
                 f"{what}: status {ran.returncode}: {ran.stdout[:300]} {ran.stderr}")
        t.expect((d / "blocked-1of2/part.json").read_bytes() == before, f"{what}: part.json has changed")
        (d / "blocked-1of2/part.json").write_bytes(before)
    refused("another seed", "blocked.json", "blocked-1of2", "1/2", "--resume", "--seed", "8")
    refused("another rig", "blocked.json", "blocked-1of2", "1/2", "--resume", rig="other-rig.json")
    refused("another recipe", "other.json", "blocked-1of2", "1/2", "--resume")
    refused("without --resume", "blocked.json", "blocked-1of2", "1/2")
    refused("finished, another number", "blocked.json", "blocked-1of2", "1/3", "--resume")
    shutil.copytree(d / "blocked-1of2", d / "whole-1of2")
    refused("finished, the other part", "blocked.json", "whole-1of2", "2/2", "--resume")
    shutil.copytree(d / "blocked-1of2", d / "new-1of2")
    refused("the other part without --resume", "blocked.json", "new-1of2", "2/2")
    shutil.copytree(d / "undisturbed", d / "begun")
    begun = json.loads((d / "begun/part.json").read_text())
    (d / "begun/part.json").write_text(json.dumps(begun | {"is_complete": False, "campaigns": []}))
    shutil.rmtree(d / "begun/0002-silk")
    refused("interrupted, the other part", "long.json", "begun", "2/2", "--resume")
    again = bench.part("blocked.json", "blocked-1of2", "1/2", "--resume")
    t.expect(again.get("is_complete") and (d / "blocked-1of2/part.json").read_bytes() == before, "--resume of a finished part changes nothing")


def stopped(bench):
    """A second process cannot write the same part. SIGTERM, as a cluster sends before SIGKILL: the status is 128 + 15, and --resume continues."""
    t, d = bench.t, bench.d
    process = subprocess.Popen([t.weft, *bench.command("long.json", "stopped", "1/1", "--json")], cwd=d, text=True, stdout=subprocess.PIPE,
                               stderr=subprocess.DEVNULL)
    end = time.monotonic() + PATIENCE_S
    while process.poll() is None and time.monotonic() < end and complete(d / "stopped/0001-denim") < 1:
        time.sleep(0.002)
    process.send_signal(signal.SIGSTOP)
    t.refuses(*bench.command("long.json", "stopped", "1/1", "--resume"), cwd=d, code="busy", where=["stopped"])
    process.send_signal(signal.SIGCONT)
    process.send_signal(signal.SIGTERM)
    text, _ = process.communicate(timeout=PATIENCE_S)
    ended = json.loads(text)
    t.expect(process.returncode == 128 + signal.SIGTERM and ended["is_complete"] is False, f"SIGTERM: {process.returncode} {ended}")
    t.expect(json.loads((d / "stopped/part.json").read_text())["is_complete"] is False, "SIGTERM: part.json of an unfinished part")
    bench.part("long.json", "stopped", "1/1", "--resume")
    bench.merge(["stopped"], "stopped.h5")
    t.expect(samples_of(d / "stopped.h5") == samples_of(d / "undisturbed.h5"), "SIGTERM: samples differ")


def accuracy(bench):
    """All parts take one setting. A part that misses its accuracy ends with 3, as a plain run does."""
    t, d = bench.t, bench.d

    def settings(name, rig, asked, status):
        found = []
        for k in (1, 2):
            ran = t.run("run", "pairs.json", "--rig", rig, "--out", f"{name}{k}", "--part", f"{k}/2", "--accuracy", asked, cwd=d)
            t.expect(ran.returncode == status, f"{name}{k}: status {ran.returncode}, not {status}: {ran.stderr}")
            found += [json.loads(file.read_text())["simulation"] for file in (d / f"{name}{k}").glob("0*/certificate.json")]
        t.expect(len(found) == 2 and len({one["setting"] for one in found}) == 1, f"{name}: {found}")
        t.expect(all(one["promise"]["held"] == (status == 0) for one in found), f"{name}: {found}")
        t.expect(bench.merge([f"{name}1", f"{name}2"], f"{name}.h5")["datasets"] == 2, f"{name}: merged")

    def promises_too_much(rig):
        table = json.loads(pathlib.Path(rig["simulation"]["fidelity"]).read_text())
        for cloth in (cloth for setting in table["settings"] for cloth in setting["cloths"]):
            cloth.update({figure: 0.1 * cloth[figure] for figure in ("q50_n", "q99_n", "max_n")})
        rig["simulation"]["fidelity"] = str(d / "table.json")
        (d / "table.json").write_text(json.dumps(table))
    bench.write_rig("coarse.json", promises_too_much)
    settings("kept", bench.rig, "120mN", 0)
    settings("missed", "coarse.json", "20mN", 3)


def killed_merge(bench):
    """A merge that is killed while it writes leaves the older file; the next one removes the rest."""
    t, d, target = bench.t, bench.d, bench.d / "target.h5"
    hits, delays = 0, random.Random(KILL_SEED)
    for attempt in range(12):
        for older in (None, b"an older file"):
            target.unlink(missing_ok=True)
            if older:
                target.write_bytes(older)
            process = subprocess.Popen([t.weft, "dataset", "merge", "first-1of1", "-o", "target.h5"], cwd=d, stdout=subprocess.DEVNULL)
            while process.poll() is None and not list(d.glob("target.h5.partial-*")):
                pass
            time.sleep(delays.uniform(0, 0.02))
            process.kill()
            process.wait(PATIENCE_S)
            if process.returncode == -signal.SIGKILL and list(d.glob("target.h5.partial-*")):
                hits += 1
                t.expect((target.read_bytes() if target.exists() else None) == older, "a killed merge changes its target")
        if hits >= 5:
            break
    t.expect(hits >= 5, f"only {hits} kills of a merge while it writes")
    bench.merge(["first-1of1"], "target.h5")
    t.expect(sha256(target) == sha256(d / "first-1.h5") and not list(d.glob("*.partial-*")), f"after kills: {list(d.glob('*.partial-*'))}")


def main():
    t, root = Checks(sys.argv[1]), pathlib.Path(sys.argv[2]).resolve()
    with tempfile.TemporaryDirectory(prefix="weft-parts-") as folder:
        d = pathlib.Path(folder).resolve()
        bench = Bench(t, d, root)
        for order in ("blocked", "randomised"):
            write_recipe(d / f"{order}.json", order)
            same_whatever_the_number(bench, f"{order}.json", order, FABRICS, ALL)
        same_whatever_the_number(bench, root / "recipes/library/first.json", "first", ["silk", "fleece", "corduroy"], 36)
        write_recipe(d / "pairs.json", fabrics=["corduroy", "silk"], both=False)
        plan_order(bench)
        first_fabric(bench)
        merged_file_opens(bench)
        wrong_parts(bench)
        other_conditions(bench, root)
        merge_keeps_inputs(bench)
        few_open_files(bench)
        run_refusals(bench, root)
        killed(bench)
        killed_between_fabrics(bench)
        stopped(bench)
        killed_merge(bench)
        accuracy(bench)
        resumed_as_another(bench)
    t.finish()


main()
