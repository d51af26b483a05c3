"""Trials of three made-up fabrics as CSV files, with their manifest."""
import csv
import random

TAXELS = 3
RATE_HZ = 50


def write_trial(path, level, ripple, seed):
    """0.4 s S, 0.6 s P, 3 s M, 0.4 s E; fabrics differ in level and ripple during M."""
    noise = random.Random(seed)
    with open(path, "w", newline="") as f:
        w = csv.writer(f)
        w.writerow(["t_s", "phase"] + [f"ch{k + 1}" for k in range(TAXELS)])
        for i in range(220):
            phase = "S" if i < 20 else "P" if i < 50 else "M" if i < 200 else "E"
            scale = ripple if phase == "M" else 1
            counts = [round(1000 + level + noise.gauss(0, 5 * scale)) for _ in range(TAXELS)]
            w.writerow([f"{i / RATE_HZ:.3f}", phase] + counts)


def write_set(folder, each=8, level=40, ripple=2):
    """`level` and `ripple`: steps from fabric to fabric."""
    folder.mkdir()
    rows = []
    for c, label in enumerate(["cotton", "silk, raw", "wool"]):
        for k in range(each):
            name = f"{c}_{k}.csv"
            write_trial(folder / name, level * c, 1 + ripple * c, 100 * c + k)
            rows.append([name, label, "AB"[k % 2]])
    write_manifest(folder / "manifest.csv", rows)
    return rows


def write_manifest(path, rows):
    with open(path, "w", newline="") as f:
        csv.writer(f).writerows([["file", "label", "group"]] + rows)
