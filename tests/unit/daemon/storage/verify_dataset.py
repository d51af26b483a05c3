#!/ usr / bin / env python3
"""Recomputes every digest of a Weft data set with h5py and hashlib, from docs/reference/dataset.md only.

    verify_dataset.py FILE.h5
"""
import hashlib
import math
import struct
import sys

import h5py


def text(value):
    raw = value.encode() if isinstance(value, str) else bytes(value)
    return struct.pack("<I", len(raw)) + raw


def optional(value):
    return struct.pack("<Bd", 0, 0.0) if math.isnan(value) else struct.pack("<Bd", 1, value)


def numbers(values, code):
    return struct.pack("<Q", values.size) + values.astype(code).tobytes()


def rows(file, name, i):
    first = int(file[f"trials/{name}_first"][i])
    return slice(first, first + int(file[f"trials/{name}_samples"][i]))


def trial_digest(file, i):
    t = file["trials"]
    taxel, clock = rows(file, "taxel", i), rows(file, "device_us", i)
    wrench, stages = rows(file, "wrench", i), rows(file, "stages", i)
    counts = file["taxel/counts"][taxel]
    whole = all(c == int(c) and 0 <= c <= 65535 and math.copysign(1, c) > 0 for c in counts.ravel())
    parts = [b"weft trial 1\n"]
    parts += [text(t[name][i]) for name in ("file", "label", "group", "exploration", "outcome")]
    parts += [struct.pack("<IIIQI", *(int(t[name][i]) for name in (
        "index", "attempt", "repetition", "patch_seed", "lost_samples")))]
    parts += [optional(float(t[name][i])) for name in ("force_rms_error_n", "force_in_band_fraction")]
    parts += [struct.pack("<IQ", counts.shape[1], counts.shape[0])]
    parts += [b"u" + counts.astype("<u2").tobytes() if whole else b"f" + counts.astype("<f8").tobytes()]
    parts += [file["taxel/phase"][taxel].tobytes()]
    parts += [numbers(file["taxel/t_ns"][taxel], "<i8"), numbers(file["taxel/device_us"][clock], "<u4")]
    for name, part in (("wrench", wrench), ("stages", stages)):
        parts += [numbers(file[name + "/t_ns"][part], "<i8"), numbers(file[name + "/quanta"][part], "<i4")]
    for name in ("acceleration", "sound"):
        if name not in file or not int(t[name + "_blocks_samples"][i]):
            continue
        blocks, readings = rows(file, name + "_blocks", i), int(file[name].attrs["block_readings"])
        parts += [f"weft {name} 1\n".encode(), numbers(file[name + "/t_ns"][blocks], "<i8")]
        parts += [numbers(file[f"{name}/{column}"][blocks], "<u4") for column in ("device_us", "lost", "clipped")]
        parts += [numbers(file[name + "/quanta"][blocks.start * readings:blocks.stop * readings], "<i4")]
    if "factors" in file:
        parts += [b"weft factors 1\n", numbers(file["factors/values"][i], "<f8")]
    return hashlib.sha256(b"".join(parts)).digest()


def main(path):
    with h5py.File(path, "r") as file:
        axes = [(bytes(name), unit == b"rad") for name, unit in zip(file["stages/axis"], file["stages/unit"])]
        whole = hashlib.sha256(b"weft dataset 1\n" + text(file.attrs["bench_kind"]))
        whole.update(struct.pack("<I", len(axes)))
        for name, rotary in axes:
            whole.update(text(name) + struct.pack("<B", rotary))
        if "factors" in file:
            names = [bytes(name) for name in file["factors/name"]]
            whole.update(b"weft factors 1\n" + struct.pack("<I", len(names)))
            for name in names:
                whole.update(text(name))
        count = len(file["trials/file"])
        whole.update(struct.pack("<Q", count))
        for i in range(count):
            digest = trial_digest(file, i)
            if digest.hex() != file["trials/sha256"][i].decode():
                sys.exit(f"trial {i} differs from its digest")
            whole.update(digest)
        stored = file.attrs["dataset_sha256"]
        stored = stored.decode() if isinstance(stored, bytes) else str(stored)
        if whole.hexdigest() != stored:
            sys.exit("the data set differs from its digest")
        print(f"{count} trials, {stored}: in order")


main(sys.argv[1])
