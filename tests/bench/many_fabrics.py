#!/usr/bin/env python3
"""Times `weft train` and `weft classify` with five hundred MADE UP fabrics.

    many_fabrics.py WEFT [FABRICS]      prints a table, writes out/bench/many_fabrics.json

8 trials of each, 4 taxels, 60 frames. A fabric is a random level, ripple and noise. p-value cores, ties by order (the default from 100 fabrics on).
Only the training has a limit (10 s); the other times are shown because users wait for them. Medians of three runs.
"""
import json
import os
import pathlib
import resource
import statistics
import subprocess
import sys
import tempfile
import time

import numpy

EACH, TAXELS, FRAMES, RUNS, LIMIT_S = 8, 4, 60, 3, 10.0


def write_set(folder, fabrics):
    random = numpy.random.default_rng(1)
    lines = ["file,label,group"]
    for fabric in range(fabrics):
        level, ripple, noise = random.uniform(500, 4000), random.uniform(5, 300), random.uniform(2, 40)
        for k in range(EACH):
            phase = random.uniform(0, 6.3, TAXELS)
            frame = numpy.arange(FRAMES)[:, None]
            counts = level * random.normal(1, 0.02) + ripple * numpy.sin(0.7 * frame + phase) + random.normal(0, noise, (FRAMES, TAXELS))
            rows = [f"{i / 50:.2f},M," + ",".join(str(round(v)) for v in row) for i, row in enumerate(counts)]
            name = f"{fabric}_{k}.csv"
            (folder / name).write_text("\n".join(["t_s,phase," + ",".join(f"ch{c + 1}" for c in range(TAXELS)), *rows]) + "\n")
            lines.append(f"{name},fabric{fabric:03},{k}")
    (folder / "manifest.csv").write_text("\n".join(lines) + "\n")


def run(weft, *arguments):
    """The command's output, and its seconds."""
    began = time.perf_counter()
    ran = subprocess.run([weft, *map(str, arguments), "--json"], capture_output=True, text=True)
    if ran.returncode != 0:
        sys.exit(f"weft {' '.join(map(str, arguments))}: {ran.stderr}")
    return json.loads(ran.stdout), time.perf_counter() - began


def measured(weft, folder, fabrics):
    write_set(folder, fabrics)
    data, model = folder / "d.h5", folder / "m.weft"
    run(weft, "dataset", "import", folder / "manifest.csv", "-o", data)
    parts = {"training": [], "calibration": [], "weft train, whole": [], "weft classify, whole": []}
    for _ in range(RUNS):
        said, whole_s = run(weft, "train", data, "-o", model, "--learner", "pvalue")
        parts["training"].append(said["train_s"])
        parts["calibration"].append(said["calibrate_s"])
        parts["weft train, whole"].append(whole_s)
    said, seconds = run(weft, "classify", model, data)
    parts["weft classify, whole"].append(seconds)
    right = sum(t["label"] == t["true_label"] for t in said["trials"])
    return parts, {"trials": len(said["trials"]), "right_of_what_trained": right, "model_bytes": model.stat().st_size,
                   "peak_mb": resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss // 1024}


def main():
    weft = str(pathlib.Path(sys.argv[1]).resolve())
    fabrics = int(sys.argv[2]) if len(sys.argv) > 2 else 500
    with tempfile.TemporaryDirectory(prefix="weft-many-") as d:
        parts, about = measured(weft, pathlib.Path(d), fabrics)
    print(f"{fabrics} MADE UP fabrics, {about['trials']} trials, model of {about['model_bytes'] / 1e6:.0f} MB, at most {about['peak_mb']} MB resident")
    figures = []
    for name, seconds in parts.items():
        value = statistics.median(seconds)
        limit = {"peer": "limit", "peer_value": LIMIT_S, "ratio": value / LIMIT_S} if name == "training" else {
            "peer": "training", "peer_value": statistics.median(parts["training"]), "ratio": value / statistics.median(parts["training"])}
        figures.append({"figure": name, "value": value, "unit": "s", "runs": seconds, **limit})
        print(f"{name:22} {value:7.2f} s   {figures[-1]['ratio']:6.2f} of {limit['peer']} ({limit['peer_value']:.2f} s)")
    out = pathlib.Path("out/bench/many_fabrics.json")
    out.parent.mkdir(parents=True, exist_ok=True)
    out.write_text(json.dumps({"name": "many_fabrics", "figures": figures, **about,
                               "commit": os.environ.get("WEFT_COMMIT", "unknown")}, indent=2) + "\n")


main()
