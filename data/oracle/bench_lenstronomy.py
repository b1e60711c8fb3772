"""haloray and lenstronomy on the same cone, rays and machine in one run: times, ratios, differences.

Needs: pip install lenstronomy==1.14.2 astropy numpy
Run:   python3 bench_lenstronomy.py --binary ../../target/release/haloray --summary ../../docs/BENCHMARKS.md

haloray is timed as a whole process, reading and writing its files included; lenstronomy by its ray shooting
alone, its set-up of the planes shown apart. The two take turns. Takes about two minutes.
"""

import argparse
import datetime
import importlib.metadata
import os
import pathlib
import platform
import subprocess
import tempfile
import time

import numpy as np

import compare_cone
from compare_cone import ARCSEC, COSMOLOGY, GM_SUN_OVER_C2_MPC, processor, read_csv, write_csv

Z_SOURCE = 1.5


class Run:
    """Calls of the haloray binary inside one folder."""

    def __init__(self, binary, folder):
        self.binary, self.folder = str(pathlib.Path(binary).resolve()), folder

    def seconds(self, *arguments):
        start = time.perf_counter()
        subprocess.run([self.binary, *map(str, arguments), "--quiet"], check=True, cwd=self.folder)
        return time.perf_counter() - start

    def repeated(self, times, *arguments):
        return [self.seconds(*arguments) for _ in range(times)]


def trace_arguments(order, threads):
    return ["trace", "--haloes", "haloes.h5", "--points", "points.csv", "--z-source", Z_SOURCE, "--order", order,
            "--threads", threads, "-o", "rays.csv"]


def lenstronomy_model(haloes):
    """The MultiPlane class with all planes and their keyword arguments, and the seconds to make them."""
    from lenstronomy.LensModel.MultiPlane.multi_plane import MultiPlane

    start = time.perf_counter()
    order = np.argsort(haloes["z"])
    models, redshifts, kwargs = [], [], []
    for z, x, y, r_s, alpha_rs in zip(*(haloes[name][order] for name in compare_cone.COLUMNS)):
        _, kappa = compare_cone.numpy_multiplane.halo_radial(np.hypot(x, y), r_s, alpha_rs)
        models += ["NFW", "CONVERGENCE"]
        redshifts += [z, z]
        kwargs += [{"Rs": r_s, "alpha_Rs": alpha_rs, "center_x": x, "center_y": y}, {"kappa": -float(kappa)}]
    lens = MultiPlane(Z_SOURCE, models, redshifts, cosmo=COSMOLOGY)
    return lens, kwargs, time.perf_counter() - start


def numpy_brute_force(relations, radius_cmpc=11.62, min_point_shear=1e-6, seed=1):
    """The same ten million haloes drawn and cut with vectorised numpy, in chunks; the number kept."""
    rng = np.random.default_rng(seed)
    mass, density = relations["m200c_msun"], relations["dn_dlnm_per_cmpc3"]
    steps = np.diff(np.log(mass))
    cumulative = np.concatenate([[0], np.cumsum(0.5 * (density[1:] + density[:-1]) * steps)])
    chi_source = COSMOLOGY.comoving_distance(Z_SOURCE).value
    z_grid = np.linspace(0, Z_SOURCE, 2001)
    chi_grid = COSMOLOGY.comoving_distance(z_grid).value
    number = rng.poisson(cumulative[-1] * np.pi * radius_cmpc**2 * chi_source)
    kept, left = 0, number
    while left > 0:
        n = min(left, 1_000_000)
        left -= n
        chi, r2 = chi_source * rng.uniform(size=n), radius_cmpc**2 * rng.uniform(size=n)
        m = np.exp(np.interp(rng.uniform(0, cumulative[-1], n), cumulative, np.log(mass)))
        einstein = 4 * GM_SUN_OVER_C2_MPC * m * (1 + np.interp(chi, chi_grid, z_grid)) * chi * (1 - chi / chi_source)
        kept += np.count_nonzero(r2 <= einstein / min_point_shear)
    return number, kept


def timed(function, *arguments):
    start = time.perf_counter()
    result = function(*arguments)
    return result, time.perf_counter() - start


def row(what, ours, theirs, their_name):
    low, middle, high = min(ours), float(np.median(ours)), max(ours)
    return f"| {what} | {middle:.3f} ({low:.3f}–{high:.3f}) | {theirs:.2f} | {their_name} | {theirs / middle:.0f} |"


def measure(binary, folder, repeats):
    run = Run(binary, folder)
    run.seconds("populate", "-o", "haloes.csv")
    run.seconds("populate", "-o", "haloes.h5")
    haloes = read_csv(folder / "haloes.csv")
    side = 0.08 * (np.arange(64) - 31.5)
    theta_y, theta_x = (grid.ravel() for grid in np.meshgrid(side, side, indexing="ij"))
    write_csv(folder / "points.csv", {"theta_x_arcsec": theta_x, "theta_y_arcsec": theta_y})

    before = run.repeated(repeats, *trace_arguments(0, 2))
    lens, kwargs, setup = lenstronomy_model(haloes)
    beta, shooting = timed(lens.ray_shooting, theta_x, theta_y, kwargs)
    two_threads = before + run.repeated(repeats, *trace_arguments(0, 2))
    rays = read_csv(folder / "rays.csv")
    difference = max(np.abs(rays["beta_x_arcsec"] - beta[0]).max(), np.abs(rays["beta_y_arcsec"] - beta[1]).max())
    one_thread = run.repeated(repeats, *trace_arguments(0, 1))
    jacobians = run.repeated(repeats, *trace_arguments(1, 2))
    _, hessian = timed(lens.hessian, np.array([0.3]), np.array([0.4]), kwargs)

    run.seconds("relations", "--masses", 1001, "-o", "relations.csv")
    brute = run.repeated(repeats, "populate", "--draw", "brute-force", "-o", "brute.csv")
    (drawn, kept), numpy_seconds = timed(numpy_brute_force, read_csv(folder / "relations.csv"))
    direct = run.repeated(repeats, "populate", "-o", "direct.h5")

    print(f"{len(haloes['z'])} haloes; lenstronomy set-up {setup:.1f} s; max |Δβ| {difference:.1e} arcsec; "
          f"numpy drew {drawn}, kept {kept}")
    return [
        f"{len(haloes['z']):,} haloes with on-axis sheets, 64×64 rays; largest difference in β {difference:.1e}″. "
        f"lenstronomy's set-up of the planes ({setup:.1f} s) is not counted.", "",
        "| what | haloray, seconds: median (min–max) | peer, seconds | peer | ratio |", "|---|---|---|---|---|",
        row("β of 64×64 rays, 2 threads", two_threads, shooting, "lenstronomy `ray_shooting`"),
        row("β of 64×64 rays, 1 thread", one_thread, shooting, "lenstronomy `ray_shooting`"),
        row("β and Jacobian of 4,096 rays, 2 threads", jacobians, hessian * 4096,
            f"lenstronomy `hessian`, one point ({hessian:.2f} s) × 4,096"),
        row("draw 10.6 million haloes, cut, write table", brute, numpy_seconds, "numpy, draw and cut only"),
        row("direct draw, write table", direct, numpy_seconds, "numpy, draw and cut only"),
    ]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--binary", required=True, help="the haloray command")
    parser.add_argument("--repeats", type=int, default=5, help="runs of each haloray command [5]")
    parser.add_argument("--summary", help="write a Markdown summary to this file")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        lines = measure(options.binary, pathlib.Path(folder), options.repeats)
    print("\n".join(lines))
    if options.summary:
        versions = ", ".join(f"{n} {importlib.metadata.version(n)}" for n in ("lenstronomy", "astropy", "numpy"))
        head = [
            "# haloray beside its peers, in one run", "",
            f"Written by `data/oracle/bench_lenstronomy.py` (`just bench`) on {datetime.date.today().isoformat()}; "
            f"{platform.system()} on {processor()}, {os.cpu_count()} cores; {versions}. haloray is timed as a whole "
            "process with its files; a ratio is the peer's seconds over the median of ours.", ""]
        pathlib.Path(options.summary).write_text("\n".join(head + lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
