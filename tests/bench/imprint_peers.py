#!/usr/bin/python3
"""Times the ten features of one imprint at several scales in typical Python forms.

imprint_peers.py IMAGE.csv SIGMAS ORACLE    one JSON object: for each form the seconds of every evaluation and its features

reference: static002.py (loops), if ORACLE exists. scipy: the same features without a loop in Python, by numpy and scipy.ndimage. opencv: the same
with OpenCV's smoothing, extrema and components, if python3-opencv is installed.
"""
import importlib.util
import json
import pathlib
import sys
import time

import numpy as np
from scipy import ndimage


def kernel(sigma):
    r = int(np.ceil(4 * sigma))
    k = np.exp(-0.5 * (np.arange(-r, r + 1) / sigma) ** 2)
    return k / k.sum()


class Scipy:
    ring = np.array([[1, 1, 1], [1, 0, 1], [1, 1, 1]], bool)

    def smooth(self, z, k):
        return ndimage.correlate1d(ndimage.correlate1d(z, k, 0, mode="nearest"), k, 1, mode="nearest")

    def ring_extremes(self, z):
        return ndimage.minimum_filter(z, footprint=self.ring), ndimage.maximum_filter(z, footprint=self.ring)

    def components(self, mask):
        return ndimage.label(mask, np.ones((3, 3)))[0]


class OpenCv:
    def __init__(self, cv2):
        self.cv2 = cv2
        self.ring = Scipy.ring.astype(np.uint8)
        cv2.setNumThreads(1)

    def smooth(self, z, k):
        return self.cv2.sepFilter2D(z, -1, k, k, borderType=self.cv2.BORDER_REPLICATE)

    def ring_extremes(self, z):
        return self.cv2.erode(z, self.ring), self.cv2.dilate(z, self.ring)

    def components(self, mask):
        return self.cv2.connectedComponents(mask.astype(np.uint8), connectivity=8)[1]


def noise(z, k):
    a, b = np.diff(z, 3, 1), np.diff(z, 3, 0)
    rms = np.sqrt((np.sum(a * a) + np.sum(b * b)) / (a.size + b.size))
    g1, g3 = np.convolve(k, [.5, 0, -.5]), np.convolve(k, [1, -3, 3, -1])
    return rms * np.sqrt(np.sum(g1 ** 2) / np.sum(g3 ** 2))


def ridges(gx, gy, m):
    """Interpolated non-maximum suppression of the interior, all taxels at once."""
    h, w = m.shape
    i, j = np.mgrid[1:h - 1, 1:w - 1]
    x, y, v = gx[1:-1, 1:-1], gy[1:-1, 1:-1], m[1:-1, 1:-1]
    ax, ay = np.abs(x), np.abs(y)
    sx, sy, flat = np.where(x > 0, 1, -1), np.where(y > 0, 1, -1), ax >= ay
    t = np.divide(np.minimum(ax, ay), np.maximum(ax, ay), out=np.zeros_like(v), where=v > 0)
    di, dj = np.where(flat, 0, sy), np.where(flat, sx, 0)
    p = (1 - t) * m[i + di, j + dj] + t * m[i + sy, j + sx]
    q = (1 - t) * m[i - di, j - dj] + t * m[i - sy, j - sx]
    out = np.zeros(m.shape, bool)
    out[1:-1, 1:-1] = (v > 0) & (v > p) & (v >= q)
    return out


def moments(v):
    return [float(len(v)), v.mean() if len(v) else 0.0, v.std() if len(v) > 1 else 0.0]


def features(tool, image, sigmas):
    out = []
    for sigma in sigmas:
        k = kernel(sigma) if sigma > 0 else np.ones(1)
        z = tool.smooth(image, k) if sigma > 0 else image
        p = np.pad(z, 1, mode="edge")
        gx, gy = (p[1:-1, 2:] - p[1:-1, :-2]) / 2, (p[2:, 1:-1] - p[:-2, 1:-1]) / 2
        m, n = np.hypot(gx, gy), noise(z, k)
        weak = ridges(gx, gy, m) & (m >= 1.2 * n)
        part = tool.components(weak)
        keep = np.zeros(part.max() + 1, bool)
        keep[part[weak & (m >= 1.8 * n)]] = True
        e = weak & keep[part]
        th = 2 * np.arctan2(gy[e], gx[e])
        r = np.hypot(np.cos(th).mean(), np.sin(th).mean()) if len(th) > 1 else 1.0
        steps = moments(m[e])
        least, most = tool.ring_extremes(z)
        out += steps + [np.sqrt(max(0.0, -2 * np.log(min(1.0, max(r, 1 / max(len(th), 1)))))) / 2]
        c = z[1:-1, 1:-1]
        mean = (sum(np.roll(np.roll(z, a, 0), b, 1) for a in (-1, 0, 1) for b in (-1, 0, 1) if a or b) / 8)[1:-1, 1:-1]
        for mask in (c < least[1:-1, 1:-1], c > most[1:-1, 1:-1]):
            out += moments(np.abs(c - mean)[mask])
    return [float(v) for v in out]


def main():
    image = np.loadtxt(sys.argv[1], delimiter=",")
    sigmas = [float(s) for s in sys.argv[2].split(",")]
    forms = {"scipy": lambda: features(scipy_tool, image, sigmas)}
    scipy_tool = Scipy()
    try:
        import cv2
        opencv_tool = OpenCv(cv2)
        forms["opencv"] = lambda: features(opencv_tool, image, sigmas)
    except ImportError:
        pass
    oracle = pathlib.Path(sys.argv[3])
    if oracle.exists():
        spec = importlib.util.spec_from_file_location("static002", oracle)
        static002 = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(static002)
        forms["reference"] = lambda: np.concatenate([static002.features(image, s)[0] for s in sigmas]).tolist()
    out = {}
    for name, run in forms.items():
        values, seconds = run(), []
        for _ in range(31):
            start = time.perf_counter()
            run()
            seconds.append(time.perf_counter() - start)
        out[name] = {"seconds": seconds, "features": values}
    json.dump(out, sys.stdout)


main()
