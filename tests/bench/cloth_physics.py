"""Features and confusions of simulated fabrics, for cloth.py."""
import csv
import itertools
import math

import numpy
from scipy.stats import spearmanr
from sklearn.feature_selection import SelectKBest, f_classif
from sklearn.model_selection import StratifiedShuffleSplit
from sklearn.multiclass import OneVsOneClassifier
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler
from sklearn.svm import SVC

KINDS = ["max", "min", "mean", "var", "norm", "range", "kurt", "skew", "mode", "m5", "Hfrq", "Sh"]
STATIC = ["mean.P", "diff.SP", "diff.PE"]
PEAK_PA = 4903.0  # 50 gf/cm2, the peak pressure of KES-FB3
FACE_M2 = 16e-3**2
FORCE_N = 5.0
PERMUTATIONS = 2000
CAP = 20  # the paper's N


def read(path):
    """Labels, names and values [trials x features] of `weft features`."""
    with open(path, newline="") as f:
        rows = list(csv.reader(f))
    return numpy.array([r[1] for r in rows[1:]]), rows[0][3:], numpy.array([[float(v) for v in r[3:]] for r in rows[1:]])


def kind_of(name):
    return name.split(".")[0] if name not in STATIC else "static"


def eta_squared(labels, values):
    """Per column: the share of its variance between the labels."""
    centred = values - values.mean(axis=0)
    between = sum((labels == k).sum() * centred[labels == k].mean(axis=0) ** 2 for k in set(labels))
    return between / (centred**2).sum(axis=0)


def between_share(path):
    """Per kind of feature the median over the pads; also for the first principal component of the scaled features."""
    labels, names, values = read(path)
    share = eta_squared(labels, values)
    kinds = numpy.array([kind_of(n) for n in names])
    out = {k: float(numpy.median(share[kinds == k])) for k in KINDS}
    scaled = (values - values.mean(axis=0)) / values.std(axis=0)
    left, size, _ = numpy.linalg.svd(scaled, full_matrices=False)
    out["component"] = float(size[0] ** 2 / (size**2).sum())
    out["of it between"] = float(eta_squared(labels, left[:, :1])[0])
    return out


def columns_of_groups(names):
    kinds = numpy.array([kind_of(n) for n in names])
    out = {k: kinds == k for k in KINDS}
    out["static (mean.P, diff.SP, diff.PE)"] = kinds == "static"
    out["Hfrq and Sh"] = numpy.isin(kinds, ["Hfrq", "Sh"])
    out["all but Hfrq and Sh"] = ~out["Hfrq and Sh"]
    out["all but range"] = kinds != "range"
    out["all"] = kinds != ""
    return out


def group_table(path):
    """Accuracy of the paper's classifier with fixed C and gamma on each group of columns, 8 splits: an RBF SVM for each pair of fabrics on the CAP
    columns of the largest |t| (for two classes, F is t squared)."""
    labels, names, values = read(path)
    splits = list(StratifiedShuffleSplit(8, train_size=0.4, random_state=1).split(values, labels))
    out = {}
    for name, columns in columns_of_groups(names).items():
        own = values[:, columns]
        right = []
        for train, test in splits:
            cap = min(CAP, own.shape[1])
            machine = OneVsOneClassifier(make_pipeline(StandardScaler(), SelectKBest(f_classif, k=cap), SVC(C=8, gamma=1 / cap)))
            right.append(float((machine.fit(own[train], labels[train]).predict(own[test]) == labels[test]).mean()))
        out[name] = {"right": float(numpy.mean(right)), "sd": float(numpy.std(right, ddof=1)), "columns": int(columns.sum())}
    return out


def compression(fabric):
    """lambda [um] of p = p_s (e^(d/lambda) - 1), and the indentation [um] at 5 N on a flat face, from LC and WC."""
    low, high, linearity = 1e-3, 500.0, fabric["LC"][0]
    for _ in range(200):
        x = 0.5 * (low + high)
        low, high = (x, high) if 2 * (1 / x - 1 / math.expm1(x)) > linearity else (low, x)
    work = fabric["WC_gfcm_cm2"][0] * 0.980665  # J/m2
    scale = 2 * work / (linearity * PEAK_PA) / x
    return 1e6 * scale, 1e6 * scale * math.log1p(FORCE_N / FACE_M2 * math.expm1(x) / PEAK_PA)


def properties(table):
    """Differences between fabrics: name of the property, its value by fabric."""
    fabrics = {f["name"]: f for f in table["fabrics"]}
    out = {name: {} for name in ("log(SMD / lambda)", "log lambda", "log indentation at 5 N", "log SMD", "friction MIU", "resilience RC",
                                 "log warp per cm", "log weft per cm", "same structure")}
    structures = sorted({f["structure"] for f in fabrics.values()})
    for name, f in fabrics.items():
        scale, depth = compression(f)
        out["log(SMD / lambda)"][name] = math.log(f["SMD_um"][0] / scale)
        out["log lambda"][name] = math.log(scale)
        out["log indentation at 5 N"][name] = math.log(depth)
        out["log SMD"][name] = math.log(f["SMD_um"][0])
        out["friction MIU"][name] = f["MIU"][0]
        out["resilience RC"][name] = f["RC_percent"][0]
        for thread in ("warp", "weft"):
            if f"{thread}_per_cm" in f:
                out[f"log {thread} per cm"][name] = math.log(f[f"{thread}_per_cm"][0])
        out["same structure"][name] = structures.index(f["structure"])
    return out


def confused(confusion):
    """[fabrics x fabrics] share of the two fabrics' trials that are predicted as the other one; the twelve worst pairs."""
    labels, count = confusion["labels"], numpy.array(confusion["count"], float)
    share = (count + count.T) / (count.sum(axis=1)[:, None] + count.sum(axis=1)[None, :])
    swapped = {(a, b): count[a, b] + count[b, a] for a, b in itertools.combinations(range(len(labels)), 2)}
    worst = sorted(swapped, key=swapped.get, reverse=True)[:12]
    return share, {"share": sum(swapped[p] for p in worst) / sum(swapped.values()),
                   "pairs": [f"{labels[a]} - {labels[b]}" for a, b in worst]}


def mantel(share, values):
    """Rank correlation of confusion with distance in one property, and its p by permutation of the fabrics that have the property."""
    known = [k for k, value in enumerate(values) if value is not None]
    share, values = share[numpy.ix_(known, known)], numpy.array([values[k] for k in known], float)
    upper = numpy.triu_indices(len(values), 1)
    whole = not numpy.any(values % 1) and len(set(values)) < len(values) / 2  # categories, not numbers
    far = (values[:, None] != values[None, :]).astype(float) if whole else abs(values[:, None] - values[None, :])
    random = numpy.random.default_rng(1)
    seen = spearmanr(share[upper], far[upper])[0]
    as_far = 0
    for _ in range(PERMUTATIONS):
        order = random.permutation(len(values))
        as_far += abs(spearmanr(share[upper], far[order][:, order][upper])[0]) >= abs(seen)
    return {"r": float(seen), "p": (as_far + 1) / (PERMUTATIONS + 1)}
