#!/usr/bin/env python3
"""A small sweep on the simulated bench by one command: its plan, its report with heat maps, its analysis; a learning curve.

    cli_design.py WEFT SOURCE_ROOT
"""
import json
import pathlib
import re
import sys
import tempfile

from cli_support import Checks


def recipe(root, **changes):
    out = json.loads((root / "recipes/library/pilot-force-speed.json").read_text())
    out.update(name="small", fabrics=["denim", "silk", "felt"])
    del out["$schema"], out["operator_steps"]
    out["explorations"]["rub"]["phases"][2]["path"] = [{"dx_mm": 0, "dy_mm": 8}]
    out["sweep"].update(factors=[{"name": "force_N", "values": [2, 5]}, {"name": "speed_mm_s", "values": [2, 4]}])
    out.update(changes)
    return out


def main(weft, root):
    root = pathlib.Path(root).resolve()
    rig = root / "sim/rigs/pilot17.json"
    with tempfile.TemporaryDirectory() as folder:
        d = pathlib.Path(folder)
        t = Checks(weft)
        (d / "sweep.json").write_text(json.dumps(recipe(root)))
        plan = json.loads(t.run("check", d / "sweep.json", "--rig", rig, "--json", cwd=d).stdout)
        t.expect(plan["trials"] == 36 and plan["sweep"]["cells"] == 4 and plan["forecast"]["mounts"] == 3, f"plan {plan}")

        ran = t.run("run", d / "sweep.json", "--rig", rig, "--out", d / "out", "--no-error-check", cwd=d)
        t.expect(ran.returncode == 0, f"run: {ran.returncode} {ran.stderr}")
        page = (d / "out/report.html").read_text()
        swept = [one for one in re.findall(r"<section.*?</section>", page, re.S) if re.search(r"<h2>[^<]*\brub</h2>", one)]
        t.expect(len(swept) == 1 and swept[0].count("<svg") >= 4 and len(re.findall(r"<b>[^<]*\b[24] N\b", swept[0])) >= 4, "the report lacks heat maps")
        t.expect(not re.search(r"(src|href)\s*=\s*[\"']http", page), "the report asks for outside resources")
        report = json.loads((d / "out/report.json").read_text())
        t.expect(len(report["design"]["sweeps"][0]["cells"]) == 4, "report.json lacks the sweep")

        got = t.run("design", "analyse", d / "out/dataset.h5", "-o", d / "pilot.html", "--json", cwd=d)
        t.expect(got.returncode == 0, f"analyse: {got.stderr}")
        found = json.loads(got.stdout)["analyses"][0]
        t.expect(found == report["design"]["sweeps"][0], "analyse and the report disagree")
        chosen = found["recommendation"]
        t.expect(found["bench"] == "simulated" and chosen["factors"]["force_n"] in (2, 5), f"recommendation {chosen}")
        t.expect(abs(sum(c["chosen_share"] for c in found["cells"]) - 1) < 1e-9, "the shares do not add up")
        t.expect(sum(c["trials"] for c in found["cells"]) == 36, "trials are missing")
        text = t.run("design", "analyse", d / "out/dataset.h5", cwd=d).stdout
        t.expect(text.startswith("SIMULATED"), "the text does not begin with SIMULATED")
        t.expect("SIMULATED" in (d / "pilot.html").read_text(), "the page has no SIMULATED")

        t.refuses("design", "repetitions", "out/dataset.h5", cwd=d, code="invalid argument", got="rub-2N-4mm_s", says=["--exploration"])
        t.refuses("design", "repetitions", "out/dataset.h5", "--exploration", "rub-2N-4mm_s", cwd=d, code="invalid argument", got="3")

        plain = recipe(root, repetitions=6)
        del plain["sweep"]
        (d / "plain.json").write_text(json.dumps(plain))
        ran = t.run("run", d / "plain.json", "--rig", rig, "--out", d / "plain", "--no-error-check", cwd=d)
        t.expect(ran.returncode == 0, f"run: {ran.returncode} {ran.stderr}")
        studies = json.loads((d / "plain/report.json").read_text())["design"]["repetitions"]
        titles = re.findall("<h2>(.*?)</h2>", (d / "plain/report.html").read_text())
        t.expect([one["exploration"] for one in studies] == ["rub"] and sum("rub" in one for one in titles) == 1, f"no learning curve: {studies}, {titles}")
        got = t.run("design", "repetitions", d / "plain/dataset.h5", "--predict", 20, "--accuracy", 0.9, "-o", d / "r.html",
                    "--json", cwd=d)
        study = json.loads(got.stdout)
        t.expect([p["repetitions"] for p in study["curve"]] == [3, 4, 5, 6], f"curve {study['curve']}")
        low, high = study["predicted"]["interval95"]
        t.expect(0 <= low <= study["predicted"]["accuracy"] <= high <= 1, f"prediction {study['predicted']}")
        t.refuses("design", "analyse", "plain/dataset.h5", cwd=d, code="invalid argument", where=["small"], got="", expected='"sweep"')
        t.refuses("design", "analyse", "out/dataset.h5", "-o", "out/dataset.h5", cwd=d, where=["out/dataset.h5"])
        t.finish()


if __name__ == "__main__":
    main(*sys.argv[1:3])
