"""Tables of vibration for scenario tests: noise of two levels."""
import random

VIBRATION_HZ = 100


def write_vibration(path, level, seed, seconds=8):
    noise = random.Random(seed)
    lines = [f"{i / VIBRATION_HZ:.2f},{noise.gauss(0, level):.6f}" for i in range(round(seconds * VIBRATION_HZ))]
    path.write_text("\n".join(["t_s,X", *lines]) + "\n")


def vibrations(folder):
    """Two textures, four recordings of each in as many groups."""
    folder.mkdir()
    rows = []
    for c, label in enumerate(("felt", "foil")):
        for k in range(4):
            write_vibration(folder / f"{label}{k}.csv", 1 + c, 10 * c + k)
            rows.append([f"{label}{k}.csv", label, str(k)])
    return rows
