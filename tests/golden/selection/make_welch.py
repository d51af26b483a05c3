#!/usr/bin/env python3
"""Welch's two-sample test by scipy and in 60 digits, for tests/unit/classifier/welch_test.cpp.

    /usr/bin/python3 make_welch.py > welch.json

t, the degrees of freedom and p are computed with mpmath from exactly the doubles of the samples. The file also has the results of
scipy.stats.ttest_ind(..., equal_var=False). The program fails if the two differ by more than 1e-12 (t) or, where p is a number, by more than 1e-10
(scipy's tail is not more accurate everywhere). Written with scipy 1.10.1, mpmath 1.2.1.
"""
import json
import sys

import mpmath
import numpy
import scipy.stats

mpmath.mp.dps = 60


def exact(x, y):
    x, y = [mpmath.mpf(v) for v in x], [mpmath.mpf(v) for v in y]
    mean = [sum(s) / len(s) for s in (x, y)]
    part = [sum((v - m) ** 2 for v in s) / (len(s) - 1) / len(s) for s, m in zip((x, y), mean)]
    t = (mean[0] - mean[1]) / mpmath.sqrt(sum(part))
    df = sum(part) ** 2 / sum(p ** 2 / (len(s) - 1) for s, p in zip((x, y), part))
    return t, df, mpmath.betainc(df / 2, mpmath.mpf(1) / 2, 0, df / (df + t * t), regularized=True)


def samples():
    """Whole numbers, so that there are no rounding errors; spreads and sizes differ, the step grows."""
    yield [1, 2, 3], [5, 7, 9, 11]
    yield [27, 22, 31, 24], [20, 21, 20, 22, 21, 20, 19]
    draw = numpy.random.RandomState(7)
    for n, m, spread_x, spread_y, step in ((8, 8, 40, 900, 300), (5, 12, 1000, 3, 900), (20, 9, 5, 4000, 0), (6, 6, 50, 50, 5 * 10**9),
                                           (30, 14, 12, 90, 10**6), (40, 31, 9, 25, 10**5), (60, 25, 17, 11, 30_000),
                                           (24, 20, 8, 14, 10**8), (33, 21, 30, 9, 700_000_000), (33, 21, 30, 9, 10**10)):
        yield (draw.randint(-spread_x, spread_x + 1, n).tolist(), (step + draw.randint(-spread_y, spread_y + 1, m)).tolist())


def main():
    out = []
    for x, y in samples():
        t, df, p = exact(x, y)
        theirs = scipy.stats.ttest_ind(numpy.array(x, float), numpy.array(y, float), equal_var=False)
        underflows = p < 1e-305
        if abs(theirs.statistic / t - 1) > 1e-12 or not underflows and abs(theirs.pvalue / p - 1) > 1e-10:
            sys.exit(f"scipy says t {theirs.statistic}, p {theirs.pvalue}; in 60 digits {t}, {p}")
        out.append({"x": x, "y": y, "t": float(t), "df": float(df), "p": float(p), "log_p": float(mpmath.log(p)),
                    "scipy_t": theirs.statistic, "scipy_p": theirs.pvalue})
    print("[" + ",\n".join(map(json.dumps, out)) + "]")


main()
