"""Elliptical power law on 100 x 100 points: haloray and lenstronomy in turns on one core.

Needs: pip install lenstronomy==1.14.2 numpy
Run:   python3 bench_lens.py --bench lens-benchmark --summary ../../docs/PROFILE_SPEED.md

`--bench` is the executable of `cargo bench --bench lens --no-run`. Same lens, same points: theta_E = 1.2 arcsec, slope 2.6,
e1 = 0.17, e2 = 0.04 (q = 0.7), a field of 5 arcsec.
"""

import argparse
import os
import subprocess
import time

import numpy as np

import page

os.environ["OMP_NUM_THREADS"] = "1"
ROUNDS, CALLS, SIDE = 5, 50, 100
LENS = {"theta_E": 1.2, "gamma": 2.6, "e1": 0.17, "e2": 0.04, "center_x": 0.01, "center_y": -0.02}


def ours(executable):
    """Median seconds a call of (deflection, with Hessian and parameter derivatives)."""
    text = subprocess.run([executable, "--bench", "epl q=0.7"], capture_output=True, text=True, check=True).stdout
    units = {"ns": 1e-9, "µs": 1e-6, "ms": 1e-3}
    rows = [row.split("│")[2].split() for row in text.splitlines() if "epl q=0.7" in row]
    deflection, everything = [float(value) * units[unit] for value, unit in rows]
    return deflection, everything


def theirs():
    """Least seconds a call of lenstronomy's (alpha, hessian)."""
    from lenstronomy.LensModel.lens_model import LensModel

    axis = (np.arange(SIDE) - 0.5 * (SIDE - 1)) * 0.05
    x, y = (grid.ravel() for grid in np.meshgrid(axis, axis))
    model = LensModel(["EPL"])

    def least(call):
        times = []
        for _ in range(CALLS):
            start = time.perf_counter()
            call(x, y, [LENS])
            times.append(time.perf_counter() - start)
        return min(times)

    return least(model.alpha), least(model.hessian)


def main():
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("--bench", required=True)
    arguments.add_argument("--summary")
    options = arguments.parse_args()
    rounds = [(ours(options.bench), theirs()) for _ in range(ROUNDS)]
    (deflection, everything), (alpha, hessian) = (
        np.min([pair[side] for pair in rounds], axis=0) / SIDE**2 * 1e9 for side in (0, 1))
    lines = [
        f"100×100 points, q = 0.7, slope 2.6, one core, best of {ROUNDS} alternating rounds.", "",
        "| what | haloray | lenstronomy | ratio |", "|---|---|---|---|",
        f"| displacement | {deflection:.1f} ns a point | {alpha:.0f} ns (`alpha`) | {alpha / deflection:.0f} |",
        f"| displacement, Hessian and the derivatives of both by all six parameters | {everything:.1f} ns a point "
        f"| {alpha + hessian:.0f} ns (`alpha` and `hessian`, no parameter derivatives) | "
        f"{(alpha + hessian) / everything:.0f} |", "",
        f"With everything a point costs {everything / deflection:.1f} displacements.", ""]
    print("\n".join(lines))
    if options.summary:
        page.write(options.summary, "just bench-lens", "\n".join(lines), ["lenstronomy"])


main()
