"""A campaign of 24 simulated trials for scenario tests: starts it with `weft run` and reads its file."""
import json
import sqlite3
import subprocess
import time

PATIENCE_S = 120
RUN = ["--no-evaluate", "--no-error-check"]


def write_recipe(root, file):
    recipe = json.loads((root / "recipes/library/m1.json").read_text())
    del recipe["$schema"]
    recipe["fabrics"], recipe["repetitions"] = ["denim", "satin"], 12
    file.write_text(json.dumps(recipe))


def read_only(folder):
    return sqlite3.connect(f"file:{folder}/campaign.sqlite?mode=ro", uri=True)


def complete(folder):
    """Number of complete trials; 0 also while the file is not readable yet."""
    if not (folder / "campaign.sqlite").exists():
        return 0
    database = read_only(folder)
    try:
        return database.execute("SELECT count(*) FROM trial WHERE outcome = 'complete'").fetchone()[0]
    except sqlite3.OperationalError:
        return 0
    finally:
        database.close()


def wait_for(folder, trials, alive):
    """Waits until `trials` are complete. `alive()`: whether the writer still runs."""
    end = time.monotonic() + PATIENCE_S
    while alive() and time.monotonic() < end:
        if complete(folder) >= trials:
            return True
        time.sleep(0.01)
    return False


def begun(weft, d, rig, out, trials, recipe="recipe.json", *more):
    """Starts a campaign and waits until `trials` are complete."""
    process = subprocess.Popen([weft, "run", recipe, "--rig", str(rig), "--out", out, *RUN, *more], cwd=d, text=True, stdout=subprocess.PIPE,
                               stderr=subprocess.PIPE)
    if wait_for(d / out, trials, lambda: process.poll() is None):
        return process
    process.kill()
    raise SystemExit(f"the run did not get to trial {trials}: {process.communicate()}")


def samples(folder):
    """Bytes of all samples of the complete trials: {(plan index, stream): bytes}."""
    database = read_only(folder)
    rows = database.execute("SELECT plan_index, stream, data FROM chunk JOIN trial ON trial.id = trial WHERE outcome = 'complete' "
                            "ORDER BY plan_index, stream, number").fetchall()
    database.close()
    joined = {}
    for index, stream, data in rows:
        joined[index, stream] = joined.get((index, stream), b"") + data
    return joined
