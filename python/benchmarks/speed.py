"""Ratios of times, both sides in one run: a lens of five profiles beside lenstronomy's, and a million rays beside the command.

    python python/benchmarks/speed.py [--command target/release/haloray]

Needs lenstronomy. Times are the best of several; the machine should have nothing else to do.
"""

import argparse
import subprocess
import tempfile
import time
from pathlib import Path

import numpy as np
from lenstronomy.LensModel.lens_model import LensModel

import haloray as hr
from haloray import _haloray

NAMES = ["EPL", "SHEAR", "NFW", "TNFW", "SERSIC_ELLIPSE_POTENTIAL"]
KWARGS = [
    {"theta_E": 1.4, "gamma": 2.2, "e1": 0.12, "e2": -0.07, "center_x": 0.0, "center_y": 0.0},
    {"gamma1": 0.03, "gamma2": -0.02},
    {"Rs": 3.1, "alpha_Rs": 0.3, "center_x": 1.0, "center_y": 0.5},
    {"Rs": 1.1, "alpha_Rs": 0.1, "r_trunc": 5.0, "center_x": -1.0, "center_y": 0.2},
    {"k_eff": 0.3, "R_sersic": 0.9, "n_sersic": 3.5, "e1": 0.05, "e2": 0.0, "center_x": 0.0, "center_y": 0.0},
]


def best(work, repeats):
    """The shortest time of a call, in seconds."""
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        work()
        times.append(time.perf_counter() - start)
    return min(times)


def lens_models():
    ours, theirs = hr.LensModel(NAMES), LensModel(NAMES)
    x, y = np.random.default_rng(1).uniform(-3.0, 3.0, (2, 10_000))
    difference = np.abs(np.subtract(ours.ray_shooting(x, y, KWARGS), theirs.ray_shooting(x, y, KWARGS))).max()
    assert difference < 1e-9, difference
    rows = [
        ("ray_shooting, 10⁴ points", lambda m: m.ray_shooting(x, y, KWARGS), 20),
        ("hessian, 10⁴ points", lambda m: m.hessian(x, y, KWARGS), 20),
        ("ray_shooting, one ray", lambda m: m.ray_shooting(1.1, 0.4, KWARGS), 2000),
    ]
    for threads in (1, 0):
        hr.set_threads(threads)
        for name, work, repeats in rows:
            own, other = best(lambda: work(ours), repeats), best(lambda: work(theirs), max(repeats // 4, 5))
            print(
                f"{name:<28} {hr.number_of_threads()} threads: haloray {own * 1e6:9.1f} µs, "
                f"lenstronomy {other * 1e6:9.1f} µs, ratio {other / own:6.1f}"
            )


def cone(command):
    haloes = hr.populate("paper", seed=1)
    n = 1000
    axis = np.linspace(-3.6, 3.6, n)
    x, y = (grid.reshape(-1) for grid in np.meshgrid(axis, axis))
    # In turns, so that a slower minute of the machine slows both.
    own, native = [], []
    for _ in range(5):
        own.append(best(lambda: hr.LineOfSight(haloes).ray_shooting(x, y), 1))
        native.append(_haloray.seconds_of_rays(haloes._native, x, y))
    print(
        f"10⁶ rays through {len(haloes)} planes, {hr.number_of_threads()} threads: {min(own):.3f} s in Python, "
        f"{min(native):.3f} s in Rust alone, ratio {min(own) / min(native):.3f}"
    )
    if command is None:
        return
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder)
        haloes.write(path / "haloes.h5")
        np.savetxt(
            path / "points.csv", np.stack([x, y], 1), delimiter=",", header="theta_x_arcsec,theta_y_arcsec", comments=""
        )
        arguments = ["trace", "--haloes", "haloes.h5", "--points", "points.csv", "--z-source", "1.5", "-o", "rays.h5"]
        start = time.perf_counter()
        subprocess.run([Path(command).resolve(), "--quiet", *arguments], cwd=folder, check=True)
        print(f"the command, files read and written too: {time.perf_counter() - start:.3f} s")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--command", help="the haloray command")
    print(hr.show_versions())
    lens_models()
    cone(parser.parse_args().command)
