#!/usr/bin/env python3
"""`weft report`: the page of a finished campaign, from its folder only. All simulated.

    cli_report.py WEFT SOURCE_ROOT
"""
import hashlib
import json
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import xml.etree.ElementTree

from cli_support import Checks

SECTIONS = 8  # at least: fabrics, features, times, trade-off, force, fidelity, verification, origin


def titles(page):
    return re.findall(r"<h2>(.*?)</h2>", page)


def campaign(t, d, root):
    recipe = json.loads((root / "recipes/library/m1.json").read_text())
    recipe.update(name="small", fabrics=["denim", "velvet", "pile"], repetitions=5, hand_over={"learner": "lda", "groups": 5})
    del recipe["$schema"]
    (d / "small.json").write_text(json.dumps(recipe))
    ran = t.run("run", "small.json", "--rig", root / "sim/rigs/bench17.json", "--out", "small", "--json", cwd=d)
    t.expect(ran.returncode == 0, f"run: {ran.stderr}")
    return json.loads(ran.stdout)


def made_afterwards(t, d, root, ran):
    told = t.succeeds("report", "small", "-o", "page.html", "--trade-splits", "2", "--vary", "features,slide", "--fidelity",
                      root / "sim/fidelity.json", cwd=d)
    t.expect(told["bench"] == "simulated" and told["verified"]["holds"] and told["verified"]["certified"], f"answer: {told}")
    page, own = (d / "page.html").read_text(), (d / "small/report.html").read_text()
    headings = titles(page)
    t.expect(len(headings) == len(set(headings)) >= SECTIONS, f"sections: {headings}")
    t.expect(set(titles(own)) - set(headings) == set(), f"sections of the run's own report: {titles(own)}, {headings}")
    for value in ("denim", "L1 3.072 ms", ran["dataset_sha256"], "recipe"):
        t.expect(value in page, f"no {value} on the page")
    xml.etree.ElementTree.fromstring(page.removeprefix("<!DOCTYPE html>\n"))
    t.expect(">recorder<" in own and ">recorder<" not in page, "no wall times, which only the run measured")
    t.expect('@top-right{content:"SIMULATED"' in page and page.count("SIMULATED") > SECTIONS, "the bench is named on paper and in every caption")
    t.expect("<script" not in page and "http://" not in page.replace("http://www.w3.org", ""), "one file, nothing from outside")
    then, now = json.loads((d / "small/report.json").read_text()), json.loads((d / "page.json").read_text())
    for same in "headline", "results", "dataset_sha256", "trials_complete", "simulation", "seed", "recipe_sha256":
        was, found = strip_times(then[same]), strip_times(now[same])
        t.expect(was == found, f"{same} is what the run's own report has")
    handed, headline = ran["handover"]["models"][0], now["headline"][0]
    t.expect([headline[k] for k in ("accuracy", "ci95", "tested", "learner")] == [handed["accuracy"], handed["ci95"], handed["asked"], handed["learner"]],
             f"one accuracy: report {headline}, hand-over {handed}")
    evaluation = json.loads((d / "small/handover/evaluation.json").read_text())
    t.expect(evaluation["explorations"]["M1"]["accuracy"] == headline["accuracy"] and headline["base_rate"] == 1 / 3, f"one accuracy: {headline}")
    t.expect(f"M1: {100 * headline['accuracy']:.1f} %" in page, "the headline on the page")
    for name, spoil in (("damaged", lambda folder: (folder / "handover/M1.model").open("ab").write(b"x")), ("none", lambda folder: shutil.rmtree(folder / "handover"))):
        shutil.copytree(d / "small", d / name)
        spoil(d / name)
        told = t.run("report", name, "-o", f"{name}.html", "--no-audit", "--no-trade", cwd=d)
        t.expect(told.returncode == (1 if name == "damaged" else 0), f"{name}: {told.stderr}")
        measured = json.loads((d / f"{name}.json").read_text())["headline"][0]
        t.expect(measured["tested"] == 15 and measured["labels"] == 3 and measured["not_tested"] == [], f"{name}: {measured}")
    one = now["audit"]["explorations"]["M1"]
    t.expect(one["verdict"] == now["audit"]["verdict"] and one["permutations"] == 99, f"audit: {now['audit']}")
    t.expect(one["probe"]["full_accuracy"] == t.succeeds("audit", "small/dataset.h5", cwd=d)["full"]["accuracy"], f"as weft audit has it: {one}")
    t.expect(one["text"].split(": ", 1)[1].replace("&", "&amp;") in page and "SIMULATED" in one["text"] and then["audit"] == now["audit"], f"audit: {one}")
    t.expect(abs(now["force_rms_error_n"] - ran["force_rms_error_n"]) < 0.02 * ran["force_rms_error_n"], "the force, computed again")


def strip_times(value):
    """The value without measured times."""
    if isinstance(value, dict):
        return {k: strip_times(v) for k, v in value.items() if not (k.endswith("_s") or k.endswith("_s_per_sample"))}
    return [strip_times(v) for v in value] if isinstance(value, list) else value


def exported(t, d, ran):
    """Writes one more file beside the campaign, which stays unchanged."""
    told = t.succeeds("export", "small", cwd=d)
    t.expect(told["dataset_sha256"] == ran["dataset_sha256"] and told["trials"] == told["trials_planned"] == 15, f"answer: {told}")
    made = (d / told["file"]).read_bytes()
    t.expect(len(made) == told["bytes"] and hashlib.sha256(made).hexdigest() == told["sha256"], f"the file's digest: {told}")
    t.expect(t.succeeds("dataset", "info", told["file"], cwd=d)["dataset_sha256"] == ran["dataset_sha256"], "a data set of the same trials")
    table = t.succeeds("export", "small", "--format", "features-csv", cwd=d)
    t.expect(len((d / table["file"]).read_text().splitlines()) == 1 + 15, f"a row a trial: {table}")
    t.succeeds("verify", "small", cwd=d)
    t.refuses("export", "small", "--exploration", "M1", cwd=d, code="invalid argument", where=["--exploration"], got="M1", expected="features-csv")
    t.refuses("export", "small", "--format", "features-csv", "--exploration", "M7", cwd=d, code="not found", where=["/exploration"], got="M7", expected="M1")


def stopped(t, d, root):
    """A campaign stopped in its first fabric has a page without the parts that need two fabrics."""
    recipe = json.loads((d / "small.json").read_text())
    recipe.update(name="stopped", fabrics=["denim", "velvet"], repetitions=20)
    (d / "stopped.json").write_text(json.dumps(recipe))
    running = subprocess.Popen([t.weft, "run", "stopped.json", "--rig", str(root / "sim/rigs/bench17.json"), "--out", "stopped"], cwd=d,
                               stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
    running.stderr.readline()
    running.terminate()
    running.communicate(timeout=120)
    ran = t.run("report", "stopped", "-o", "cut.html", cwd=d)
    t.expect(ran.returncode == 0 and ran.stderr, f"stopped: {ran.returncode} {ran.stderr}")
    cut, whole = titles((d / "cut.html").read_text()), titles((d / "page.html").read_text())
    force_rms = [json.loads((d / f"{name}.json").read_text())["force_rms_error_n"] for name in ("cut", "page")]
    t.expect(0 < len(set(cut) & set(whole)) < len(whole) and all(0 < one < 0.5 for one in force_rms), f"the parts of one fabric: {cut}, {whole}, {force_rms}")


def few(t, d, root):
    """With too few repetitions the audit reports the missing data and the reason for the missing figure."""
    for repetitions, verdict, why in ((1, "cannot_tell", "one_recording"), (2, None, None)):
        recipe = json.loads((d / "small.json").read_text())
        recipe.update(name=f"few{repetitions}", fabrics=["denim", "velvet"], repetitions=repetitions)
        recipe.pop("hand_over", None)
        (d / "few.json").write_text(json.dumps(recipe))
        ran = t.run("run", "few.json", "--rig", root / "sim/rigs/bench17.json", "--out", f"few{repetitions}", "--no-evaluate", cwd=d)
        t.expect(ran.returncode == 0, f"run: {ran.stderr}")
        t.succeeds("report", f"few{repetitions}", "-o", "short.html", "--no-trade", cwd=d)
        one = json.loads((d / "short.json").read_text())["audit"]["explorations"]["M1"]
        t.expect((one["verdict"], one["why"], one["probe"]) == (verdict, why, None) and one["reason"], f"{repetitions} repetitions: {one}")
        t.succeeds("report", f"few{repetitions}", "-o", "short.html", "--no-trade", "--no-audit", cwd=d)
        t.expect(json.loads((d / "short.json").read_text())["audit"] is None, "--no-audit")


def refused(t, d):
    t.refuses("report", "small", "-o", "page.pdf", cwd=d, says=["page.pdf", ".html"])
    t.refuses("report", "small", "-o", "nowhere/page.html", cwd=d, says=["nowhere"])
    (d / "empty").mkdir()
    t.refuses("report", "empty", "-o", "page.html", cwd=d, code="not found", where="empty/campaign.sqlite", got="")


def damaged(t, d):
    file = d / "small/campaign.sqlite"
    raw = bytearray(file.read_bytes())
    raw[len(raw) // 2] ^= 1
    file.write_bytes(raw)
    ran = t.run("report", "small", "-o", "damaged.html", "--no-trade", "--json", cwd=d)
    t.expect(ran.returncode == 1, f"one bit: {ran.returncode} {ran.stderr}")
    if (d / "damaged.html").exists():
        verified = json.loads(ran.stdout)["verified"]
        t.expect(not verified["holds"] and verified["findings"], f"one bit: {verified}")
        t.expect(any(one["where"] in (d / "damaged.html").read_text() for one in verified["findings"]), "the page has the place")


def main():
    root = pathlib.Path(sys.argv[2]).resolve()
    t = Checks(sys.argv[1])
    with tempfile.TemporaryDirectory() as name:
        d = pathlib.Path(name)
        ran = campaign(t, d, root)
        made_afterwards(t, d, root, ran)
        exported(t, d, ran)
        stopped(t, d, root)
        few(t, d, root)
        refused(t, d)
        damaged(t, d)
    return t.finish()


if __name__ == "__main__":
    sys.exit(main())
