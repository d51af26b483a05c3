#!/usr/bin/env python3
"""The accuracy on simulated fabric comes from its physics: with labels in random order only chance remains.

    permuted_labels.py WEFT SOURCE_ROOT

Runs a campaign of six fabrics, ten repetitions each, on the simulated bench, then `weft evaluate --permute-labels`. For each reduction of the
features, the accuracy after training on shuffled labels must equal that of guessing, within a bound. A method without a leak exceeds the bound by
chance once in 10 000 seeds. The accuracy with true labels must be far above it. The seeds are fixed, so the result is always the same.
"""
import json
import math
import pathlib
import sys
import tempfile

from cli_support import Checks

FABRICS = ["wool", "velvet", "denim", "satin", "felt", "corduroy"]
REPETITIONS = 10
PERMUTATIONS = 20
FALSE_ALARM = 1e-4  # for each of the reductions, both sides together


def binomial_bound(n, p, false_alarm):
    """Fewest and most successes of n such that the tail beyond each has at most half of `false_alarm`."""
    log_p, log_q = math.log(p), math.log1p(-p)
    mass = [math.exp(math.lgamma(n + 1) - math.lgamma(k + 1) - math.lgamma(n - k + 1) + k * log_p + (n - k) * log_q)
            for k in range(n + 1)]

    def beyond(order):
        tail = 0.0
        for k in order:
            tail += mass[k]
            if tail > false_alarm / 2:
                return k
        raise ValueError("no bound")

    return beyond(range(n + 1)), beyond(range(n, -1, -1))


def judge(t, name, result):
    permuted = result["permuted"]
    tested, chance = permuted["tested"], 1 / len(FABRICS)
    t.expect(tested == PERMUTATIONS * len(FABRICS) * round(0.6 * REPETITIONS), f"{name}: {tested} answers")
    t.expect(abs(permuted["chance"] - chance) < 1e-9, f"{name}: chance {permuted['chance']}")
    right = round(permuted["accuracy"] * tested)
    low, high = binomial_bound(tested, chance, FALSE_ALARM)
    print(f"{name}: true labels {100 * result['accuracy']:.1f} %, shuffled {100 * permuted['accuracy']:.1f} % "
          f"({right} of {tested}; chance alone stays within {low} to {high})")
    t.expect(low <= right <= high, f"{name}: {right} of {tested} right with shuffled labels, not {low} to {high}")
    t.expect(len(set(permuted["accuracy_of_permutations"])) > 1, f"{name}: the permutations are all the same")
    t.expect(result["accuracy"] > 3 * chance and result["ci95"][0] > high / tested,
             f"{name}: true labels {result['accuracy']} {result['ci95']}")


def main():
    t = Checks(sys.argv[1])
    root = pathlib.Path(sys.argv[2]).resolve()
    # checks the bound itself by closed forms: a fair coin tossed three times, and the widest bound
    t.expect(binomial_bound(3, 0.5, 0.2) == (0, 3) and binomial_bound(3, 0.5, 0.3) == (1, 2), "binomial bound")
    with tempfile.TemporaryDirectory(prefix="weft-permuted-") as folder:
        d = pathlib.Path(folder)
        recipe = json.loads((root / "recipes/library/m1.json").read_text())
        recipe.update(name="permuted", fabrics=FABRICS, repetitions=REPETITIONS)
        del recipe["$schema"]
        (d / "recipe.json").write_text(json.dumps(recipe))
        ran = t.run("run", "recipe.json", "--rig", root / "sim/rigs/bench17.json", "--out", "out", "--no-evaluate",
                    cwd=d)
        t.expect(ran.returncode == 0, f"run: {ran.returncode} {ran.stderr}")
        ran = t.run("evaluate", "out/dataset.h5", "--train-fraction", "0.4", "--repeats", "30", "--permute-labels",
                    PERMUTATIONS, "--json", cwd=d)
        t.expect(ran.returncode == 0, f"evaluate: {ran.returncode} {ran.stderr}")
        results = json.loads(ran.stdout)["results"] if ran.returncode == 0 else {}
        t.expect(set(results) >= {"pvalue", "pca", "all"}, f"results: {list(results)}")
        for name, result in results.items():
            judge(t, name, result)
        t.refuses("evaluate", "out/dataset.h5", "--train-groups", "0", "--test-groups", "1", "--permute-labels", "3",
                  cwd=d, says=["--permute-labels", "--train-fraction"], status=2)
    t.finish()


main()
