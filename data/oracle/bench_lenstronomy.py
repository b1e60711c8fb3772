"""haloray and lenstronomy on the same cone, rays and machine in one run: times, ratios, differences.

Needs: pip install lenstronomy==1.14.2 astropy numpy
Run:   python3 bench_lenstronomy.py --binary ../../target/release/haloray --bench BENCH --summary ../../docs/BENCHMARKS.md

The tracers are timed inside their processes, from columns of haloes in memory to β in memory, the set-up of the planes
included on both sides; BENCH is the executable of `cargo bench --bench adaptive`. Draws are timed as whole processes with
their files. The two take turns. Takes about two minutes; with --scaling two more and 6 GB.
"""

import argparse
import csv
import os
import pathlib
import subprocess
import tempfile
import time

import numpy as np

import compare_cone
import page
from compare_cone import ARCSEC, COSMOLOGY, GM_SUN_OVER_C2_MPC, read_csv, write_csv

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


def bench(executable, *arguments):
    """Rows of the table that the executable prints, as dictionaries."""
    output = subprocess.run([str(executable), *map(str, arguments)], check=True, capture_output=True, text=True)
    return list(csv.DictReader(output.stdout.splitlines()))


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


def ratio_row(what, ours, theirs, their_name):
    low, middle, high = (float(ours[name]) for name in ("min_s", "median_s", "max_s"))
    return f"| {what} | {middle:.3f} ({low:.3f}–{high:.3f}) | {theirs:.4g} | {their_name} | {theirs / middle:.0f} |"


def measure(binary, executable, folder, repeats):
    run = Run(binary, folder)
    run.seconds("populate", "-o", "haloes.csv")
    haloes = read_csv(folder / "haloes.csv")
    side = 3.6 * ((np.arange(64) + 0.5) / 64 - 0.5)
    theta_y, theta_x = (grid.ravel() for grid in np.meshgrid(side, side, indexing="ij"))
    write_csv(folder / "points.csv", {"theta_x_arcsec": theta_x, "theta_y_arcsec": theta_y})

    before = bench(executable, "peers", folder / "haloes.csv")
    lens, kwargs, setup = lenstronomy_model(haloes)
    beta, shooting = timed(lens.ray_shooting, theta_x, theta_y, kwargs)
    _, many = timed(lens.ray_shooting, *np.tile([theta_x, theta_y], 4), kwargs)
    _, hessian = timed(lens.hessian, np.array([0.3]), np.array([0.4]), kwargs)
    after = bench(executable, "peers", folder / "haloes.csv")
    best = {}
    for line in before + after:
        key = (line["rays"], line["order"], line["accuracy"], line["threads"])
        if key not in best or float(line["median_s"]) < float(best[key]["median_s"]):
            best[key] = line

    def ours(rays, order, threads, accuracy="1e-7″"):
        return best[str(rays), str(order), accuracy, str(threads)]

    differences = {}
    for accuracy in ("1e-7", "exact"):
        run.seconds("trace", "--haloes", "haloes.csv", "--points", "points.csv", "--z-source", Z_SOURCE, "--accuracy",
                    accuracy, "-o", "rays.csv")
        rays = read_csv(folder / "rays.csv")
        differences[accuracy] = max(np.abs(rays["beta_x_arcsec"] - beta[0]).max(),
                                    np.abs(rays["beta_y_arcsec"] - beta[1]).max())

    run.seconds("relations", "--masses", 1001, "-o", "relations.csv")
    brute = run.repeated(repeats, "populate", "--draw", "brute-force", "-o", "brute.csv")
    (drawn, kept), numpy_seconds = timed(numpy_brute_force, read_csv(folder / "relations.csv"))
    direct = run.repeated(repeats, "populate", "-o", "direct.h5")

    # Beyond 16,384 rays lenstronomy's time is linear in the rays.
    per_ray = (many - shooting) / (3 * 4096)
    of_250000 = setup + shooting + per_ray * (250_000 - 4096)
    once, whole = "`ray_shooting`", "set-up and `ray_shooting`"
    rows = [
        f"{len(haloes['z']):,} haloes with on-axis sheets, 64×64 rays in 3.6″. Largest difference in β from lenstronomy: exact "
        f"{differences['exact']:.1e}″, at accuracy 1e-7″ {differences['1e-7']:.1e}″. lenstronomy takes {setup:.1f} s to set up the planes and "
        f"{shooting:.1f} s to shoot 64×64 rays. Its figure for 250,000 rays is extrapolated from 4,096 and 16,384, that for the "
        "maps from one Hessian (which lacks second derivatives).", "",
        "| what | haloray, seconds: median (min–max) | peer, seconds | peer | ratio |", "|---|---|---|---|---|"]
    for threads in (2, 1):
        name = f"{threads} thread" + "s" * (threads > 1)
        rows += [
            ratio_row(f"β of 64×64 rays to 1e-7″, {name}", ours(4096, 0, threads), setup + shooting, whole),
            ratio_row(f"β of 64×64 rays, exact, {name}", ours(4096, 0, threads, "exact"), setup + shooting, whole),
            ratio_row(f"β of 100×100 pixels × 5×5 to 1e-7″, {name}", ours(250000, 0, threads), of_250000, whole),
            ratio_row(f"κ, γ, ω, F, G on 101×101 points, {name}", ours(10201, 2, threads), setup + hessian * 10201,
                      f"`hessian`, one point ({hessian:.2f} s) × 10,201"),
        ]
    print(f"lenstronomy {once}: {shooting:.2f} s, 16,384 rays {many:.2f} s; numpy drew {drawn}, kept {kept}")
    return rows + [
        row("draw 10.6 million haloes, cut, write table", brute, numpy_seconds, "numpy, draw and cut only"),
        row("direct draw, write table", direct, numpy_seconds, "numpy, draw and cut only"),
    ]


def scaling(executable, figure):
    """Times over haloes and rays as a table, and as a figure beside it."""
    import matplotlib
    matplotlib.use("svg")
    from matplotlib import pyplot

    lines = bench(executable, "scaling")
    rows = ["", "### How it grows", "", "To 1e-7″ or exactly, one run; set-up of the planes included.", "",
            "| haloes | rays | accuracy | threads | seconds | bound | measured | rays traced exactly |",
            "|---|---|---|---|---|---|---|---|"]
    for line in lines:
        rows.append(f"| {int(line['haloes']):,} | {int(line['rays']):,} | {line['accuracy']} | {line['threads']} | "
                    f"{float(line['median_s']):.3f} | {line['bound_arcsec']} | {line['measured_arcsec']} | "
                    f"{int(line['rays_traced_exactly']):,} |")

    def curve(x, **wanted):
        """Sorted abscissae and the least median at each, of the lines with those values."""
        best = {}
        for line in lines:
            if all(line[name] == value for name, value in wanted.items()):
                best[float(line[x])] = min(best.get(float(line[x]), np.inf), float(line["median_s"]))
        return np.array(sorted(best.items())).T

    cone, fine = lines[-1]["haloes"], lines[-1]["accuracy"]
    by_haloes = curve("haloes", rays="4096", accuracy=fine, threads="2")
    exponent = np.polyfit(np.log(by_haloes[0]), np.log(by_haloes[1]), 1)[0]
    panels, (left, middle, right) = pyplot.subplots(1, 3, figsize=(11, 3.6))
    left.loglog(*by_haloes, "o-", label="64×64 rays to 1e-7″")
    left.set(xlabel="haloes", ylabel="seconds, 2 threads")
    middle.loglog(*curve("rays", haloes=cone, accuracy=fine, threads="2"), "o-", label="to 1e-7″")
    middle.loglog(*curve("rays", haloes=cone, accuracy="exact", threads="2"), "s--", label="exact")
    middle.set(xlabel=f"rays through {int(cone):,} haloes", ylabel="seconds, 2 threads")
    gains = []
    for rays, accuracy, style in (("262144", fine, "o-"), ("4096", "exact", "s--")):
        threads, seconds = curve("threads", haloes=cone, rays=rays, accuracy=accuracy)
        gains.append(f"{seconds[0] / seconds[-1]:.2f} times with {threads[-1]:.0f} threads ({accuracy}, {int(rays):,} rays)")
        right.plot(threads, seconds[0] / seconds, style, label=f"{accuracy}, {int(rays):,} rays")
    right.plot(threads, threads, ":", color="grey", label="ideal")
    right.set(xlabel="threads", ylabel="faster than one thread", xticks=threads)
    for panel in (left, middle, right):
        panel.legend()
    panels.tight_layout()
    panels.savefig(figure, metadata={"Date": None})
    return rows + [
        "", f"From {by_haloes[0][0]:.0f} to {by_haloes[0][-1]:.0f} haloes the time grows with the power {exponent:.2f} of "
        f"their number. Faster than one thread: {'; '.join(gains)}.", "",
        "![seconds against haloes, rays and threads](figures/scaling.svg)"]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--binary", required=True, help="the haloray command")
    parser.add_argument("--bench", required=True, help="the executable of `cargo bench --bench adaptive`")
    parser.add_argument("--scaling", action="store_true", help="also time cones of 1e4 to 1e7 haloes and draw the figure")
    parser.add_argument("--repeats", type=int, default=5, help="runs of each haloray command [5]")
    parser.add_argument("--summary", help="write a Markdown summary to this file")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        lines = measure(options.binary, options.bench, pathlib.Path(folder), options.repeats)
    if options.scaling:
        figures = pathlib.Path(options.summary or "docs/BENCHMARKS.md").resolve().parent / "figures"
        lines += scaling(options.bench, figures / "scaling.svg")
    print("\n".join(lines))
    if options.summary:
        head = [
            "Tracers are timed from columns in memory to β in memory, set-up of the planes included on both sides; draws as "
            "whole processes with their files. A ratio is the peer's seconds over the median of ours. Load average at the "
            f"end {os.getloadavg()[0]:.1f}.", ""]
        page.write(options.summary, "just bench-peers", "\n".join(head + lines), ["lenstronomy", "astropy", "numpy"])


if __name__ == "__main__":
    main()
