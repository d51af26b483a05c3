#!/usr/bin/env python3
"""`weft` with a user's own recordings of vibration, made up: components, the next session, reports on features, refusals.

    cli_own_vibrations.py WEFT
"""
import pathlib
import random
import re
import sys
import tempfile

from cli_support import Checks, has, line_has
from made_up_cloths import write_manifest
from made_up_vibrations import VIBRATION_HZ, vibrations


def imported(t, d, name, rows):
    write_manifest(d / f"{name}.csv", rows)
    return t.succeeds("dataset", "import", f"{name}.csv", "-o", f"{name}.h5", "--format", "recordings", cwd=d)


def two_axes(folder, rate_hz):
    """Two textures with similar X and Y; one of them vibrates a little more in Y."""
    folder.mkdir()
    rows = []
    for c, label in enumerate(("felt", "foil")):
        for k in range(4):
            noise = random.Random(10 * c + k)
            lines = []
            for i in range(2000):
                both = noise.gauss(0, 1 + (i // 200 + k) % 5)
                lines.append(f"{i / rate_hz:.7f},{both:.6f},{both * (1.05 if c else 1):.6f}")
            (folder / f"{label}{k}.csv").write_text("\n".join(["t_s,X,Y", *lines]) + "\n")
            rows.append([f"{label}{k}.csv", label, str(k)])
    return rows


def components(t, d):
    """With two columns both components are used, and together they separate the labels. Earlier versions used none."""
    folder = d / "axes"
    imported(t, folder, "axes", two_axes(folder, VIBRATION_HZ))
    ask = ("evaluate", "axes.h5", "--method", "NB", "--features", "FFT", "--window-s", "2", "--leave-one-group-out")
    right = {}
    for asked, taken in ((0, 0), (1, 1), (2, 2), (3, 2)):
        told = t.succeeds(*ask, "--components", asked, cwd=folder)["results"]["nb"]
        t.expect(told["components"] == taken, f"--components {asked}: {told['components']} taken")
        right[asked] = told["accuracy"]
    t.expect(right[2] == right[3] > right[0] + 0.2, f"accuracy with turned columns: {right}")
    for asked in (2, 3):
        made = t.succeeds("train", "axes.h5", "-o", f"{asked}.model", "--method", "NB", "--features", "FFT", "--components", asked, cwd=folder)
        t.expect(made["components"] == 2 and "2 components" in made["training"], f"trained: {made}")
    t.expect((folder / "2.model").read_bytes() == (folder / "3.model").read_bytes(), "three of two are two")


def next_session(t, d):
    """A session of the same sensor on another day, with its clock 100 ppm off, is classified; that of another sensor is refused."""
    for name, ppm in (("session", 100), ("other", 400)):
        imported(t, d / name, name, two_axes(d / name, VIBRATION_HZ * (1 + 1e-6 * ppm)))
    told = t.succeeds("classify", "axes/3.model", "session/session.h5", cwd=d)
    t.expect(len(told["recordings"]) == 8, f"answered: {told}")
    t.refuses("classify", "axes/3.model", "other/other.h5", cwd=d, code="invalid argument", where=["other.h5"], got="100.04", expected="100")


def what_matters(t, d):
    """A tree that separates two levels needs one of their features: the others have no importance and are not listed."""
    ask = ("evaluate", "clean.h5", "--method", "Tree", "--features", "SMMRP10", "--window-s", "1", "--importance", "3")
    told = t.succeeds(*ask, cwd=d)["importance"]
    cost = [(f["permutation"], f["forest"]) for f in told["features"]]
    t.expect(cost == sorted(cost, reverse=True), f"equal costs by the share in a forest: {cost}")
    named = [f["feature"] for f in told["features"][:5] if f["permutation"] > 0]
    t.expect(0 < len(named) < 5 and told["most_permutation"] == named, f"only what costs something: {told['most_permutation']}, {cost}")
    t.expect(line_has(t.run(*ask, cwd=d).stdout, [", ".join(named)]), "the text has them too")


def outliers(t, d):
    """A knock in a recording of one texture: with --outliers its windows do not train, all windows test, and both are reported."""
    folder = d / "knocked"
    rows = vibrations(folder)
    lines = (folder / "felt0.csv").read_text().splitlines()
    lines[400] = lines[400].split(",")[0] + ",500"
    (folder / "felt0.csv").write_text("\n".join(lines) + "\n")
    imported(t, folder, "knocked", rows)
    ask = ("evaluate", "knocked.h5", "--method", "NB", "--window-s", "1", "--leave-one-group-out")
    every, told = (t.succeeds(*ask, *more, cwd=folder) for more in ((), ("--outliers", "4")))
    t.expect(every["outliers"] == 0 and every["results"]["nb"]["outliers"] == {}, f"off by default: {every['outliers']}")
    result = told["results"]["nb"]
    t.expect(told["outliers"] == 4 and result["outliers"]["felt"] > 0 and result["outliers"]["foil"] == 0, f"left out: {result['outliers']}")
    t.expect(result["windows_tested"] == every["results"]["nb"]["windows_tested"] == told["windows"], "no test window is left out")
    made = t.succeeds("train", "knocked.h5", "-o", "k.model", "--method", "NB", "--window-s", "1", "--outliers", "4", cwd=folder)
    t.expect(made["outliers"]["deviations"] == 4 and made["outliers"]["left_out"]["felt"] > 0, f"train: {made['outliers']}")
    t.expect(has(made["training"], ["4", f"felt {made['outliers']['left_out']['felt']}"]) and made["training"] in (folder / "k.model").read_text(),
             f"provenance: {made['training']}")
    t.refuses(*ask, "--outliers", "0.01", cwd=folder, code="range", expected="0.01", says=["--outliers"])
    t.refuses("evaluate", "clean.h5", "--outliers", "-1", "--method", "NB", cwd=d, says=["--outliers"], status=2)


def only_of_vibtac12(t, d):
    write_manifest(d / "all.csv", [["felt0.csv", "felt", "0"], ["foil0.csv", "foil", "0"]])
    for kind in ("recordings", "manifest"):
        t.refuses("dataset", "import", "--format", kind, "all.csv", "-o", "bad.h5", "--channels", "Y", cwd=d, says=["--channels", "vibtac12", kind])


def texts(t, d):
    """The messages name the true reason of a refusal."""
    t.refuses("evaluate", "clean.h5", "--method", "NB", "--window-s", "0.002", cwd=d, code="range", got="0.002 s", expected="100 Hz")
    lines = (d / "felt0.csv").read_text().splitlines()
    lines[9] = lines[9].split(",")[0] + ",1e308"
    (d / "loud.csv").write_text("\n".join(lines) + "\n")
    imported(t, d, "huge", [["loud.csv", "felt", "0"], ["foil0.csv", "foil", "0"]])
    error = t.refuses("evaluate", "huge.h5", "--method", "NB", "--window-s", "1", cwd=d, code="range", where=["loud.csv"], got="1e+308")
    t.expect(len(error["sentence"]) < 200, f"short enough to read: {error['sentence']}")
    t.succeeds("train", "clean.h5", "-o", "clean.model", "--method", "NB", cwd=d)
    t.succeeds("imprint", "scene", "-o", "z.h5", "--side", "8", cwd=d)
    t.refuses("classify", "clean.model", "z.h5", cwd=d, code="not found", where="z.h5", says=["vibro"])
    t.refuses("evaluate", "clean.h5", "--method", "NB", "--exploration", "V1", cwd=d, code="invalid argument", where=["clean.h5: --exploration"], got="V1")
    few = ("--method", "NB", "--features", "FFT", "--per-recording", "10", "--repeats", "2")
    t.succeeds("trade", "vibro", "clean.h5", "-o", "t.html", "--window-s", "0.5", *few, cwd=d)
    page = (d / "t.html").read_text()
    titles = re.findall("<h2>(.*?)</h2>", page)
    t.expect("Figure 4" not in page and sum("clean.h5" in one for one in titles) == 2, f"a section for each protocol, none without a table: {titles}")


def main():
    t = Checks(sys.argv[1])
    with tempfile.TemporaryDirectory(prefix="weft-vibrations-") as name:
        d = pathlib.Path(name) / "own"
        imported(t, d, "clean", vibrations(d))
        components(t, d)
        next_session(t, d)
        what_matters(t, d)
        outliers(t, d)
        only_of_vibtac12(t, d)
        texts(t, d)
    t.finish()


main()
