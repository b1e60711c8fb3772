"""Trace one large cone with haloray, lenstronomy and a numpy recursion, and say how far they differ.

Needs: pip install lenstronomy==1.14.2 colossus astropy numpy scipy
Run:   python3 compare_cone.py --binary ../../target/release/haloray
       python3 compare_cone.py --binary haloray --haloes haloes.csv --rays 64 --summary ../../docs/ORACLE.md

Without --haloes the script draws a cone of about 35,000 haloes itself (colossus: Tinker08 and DJ19 at z = 0.5);
a table made by `haloray populate -o haloes.csv` serves as well. beta is compared with lenstronomy's
MultiPlane, A with the recursion of data/reference/numpy_multiplane.py; numpy and lenstronomy take up to a minute.
"""

import argparse
import csv
import pathlib
import subprocess
import sys
import tempfile
import time
import warnings

import numpy as np
from astropy import constants
from astropy.cosmology import FlatLambdaCDM

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "reference"))
import numpy_multiplane
import page

warnings.simplefilter("ignore")
COSMOLOGY = FlatLambdaCDM(67.4, 0.315, Tcmb0=0)
ARCSEC = np.pi / 648000
GM_SUN_OVER_C2_MPC = float((constants.GM_sun / constants.c**2).to("Mpc").value)
COLUMNS = ["z", "theta_x_arcsec", "theta_y_arcsec", "r_s_arcsec", "alpha_rs_arcsec"]


def draw_cone(z_source, radius_cmpc=11.62, min_point_shear=1e-6, seed=1):
    """The haloes that pass the point-lens shear cut, drawn cell by cell on a grid of distance and mass."""
    from colossus.cosmology import cosmology as colossus_cosmology
    from colossus.halo import concentration
    from colossus.lss import mass_function

    rng = np.random.default_rng(seed)
    h = colossus_cosmology.setCosmology("planck18", persistence="").h
    ln_edges = np.linspace(np.log(1e8 / 0.674), np.log(1e15 / 0.674), 1001)
    ln_mass = 0.5 * (ln_edges[1:] + ln_edges[:-1])
    dn = 0.674**3 * mass_function.massFunction(
        np.exp(ln_mass) * 0.674, 0.5, q_out="dndlnM", mdef="200c", model="tinker08")
    chi_source = COSMOLOGY.comoving_distance(z_source).value
    chi_edges = np.linspace(0, chi_source, 1001)
    chi = 0.5 * (chi_edges[1:] + chi_edges[:-1])
    z_grid = np.linspace(0, z_source, 20001)
    z_of = lambda distance: np.interp(distance, COSMOLOGY.comoving_distance(z_grid).value, z_grid)
    einstein = 4 * GM_SUN_OVER_C2_MPC * (1 + z_of(chi)) * chi * (chi_source - chi) / chi_source
    area = np.pi * np.minimum(radius_cmpc**2, einstein[:, None] * np.exp(ln_mass) / min_point_shear)
    number = rng.poisson(dn * np.diff(ln_edges) * area * np.diff(chi_edges)[:, None])
    cell_chi, cell_mass = np.nonzero(number)
    count = number[cell_chi, cell_mass]
    cell_chi, cell_mass = np.repeat(cell_chi, count), np.repeat(cell_mass, count)
    total = len(cell_chi)
    mass = np.exp(ln_mass[cell_mass] + np.diff(ln_edges)[0] * rng.uniform(-0.5, 0.5, total))
    distance = chi[cell_chi] + np.diff(chi_edges)[0] * rng.uniform(-0.5, 0.5, total)
    z = z_of(distance)
    radius = np.sqrt(area[cell_chi, cell_mass] / np.pi * rng.uniform(0, 1, total))
    phi = rng.uniform(0, 2 * np.pi, total)
    c = concentration.concentration(mass * h, "200c", 0.5, model="diemer19", range_return=False)
    r_200 = (3 * mass / (800 * np.pi * COSMOLOGY.critical_density(z).to("Msun/Mpc3").value)) ** (1 / 3)
    r_s = r_200 / c
    alpha_rs = (4 * GM_SUN_OVER_C2_MPC * mass / (r_s * (np.log1p(c) - c / (1 + c))) * (1 - np.log(2))
                * (1 - distance / chi_source))
    order = rng.permutation(total)
    columns = (z, radius / distance * np.cos(phi) / ARCSEC, radius / distance * np.sin(phi) / ARCSEC,
               r_s * (1 + z) / distance / ARCSEC, alpha_rs / ARCSEC)
    return dict(zip(COLUMNS, (column[order] for column in columns)))


def read_csv(path):
    with open(path, encoding="utf-8") as lines:
        rows = csv.reader(line for line in lines if not line.startswith("#"))
        names = next(rows)
        values = np.array([[float(cell) for cell in row] for row in rows]).T
    return dict(zip(names, values))


def write_csv(path, columns):
    with open(path, "w", encoding="utf-8") as out:
        out.write(",".join(columns) + "\n")
        for row in zip(*columns.values()):
            out.write(",".join(f"{value:.17g}" for value in row) + "\n")


def trace_with_haloray(binary, haloes, points, z_source, folder):
    write_csv(folder / "haloes.csv", haloes)
    write_csv(folder / "points.csv", points)
    command = [binary, "trace", "--haloes", folder / "haloes.csv", "--points", folder / "points.csv",
               "--z-source", str(z_source), "--accuracy", "exact", "--order", "1", "-o", folder / "rays.csv"]
    subprocess.run([str(part) for part in command], check=True, stdout=subprocess.DEVNULL)
    rays = read_csv(folder / "rays.csv")
    beta = np.array([rays["beta_x_arcsec"], rays["beta_y_arcsec"]])
    return beta, np.array([rays[f"a_{part}"] for part in ("xx", "xy", "yx", "yy")])


def trace_with_numpy(haloes, theta, z_source):
    chi = COSMOLOGY.comoving_distance(haloes["z"]).value
    centres = [haloes[name] for name in COLUMNS[1:]]
    planes = [(chi[i], numpy_multiplane.halo_plane(*(column[i] for column in centres))[0])
              for i in np.argsort(haloes["z"])]
    return numpy_multiplane.trace(*theta, planes, COSMOLOGY.comoving_distance(z_source).value)


def trace_with_lenstronomy(haloes, theta, z_source):
    """beta, the seconds to set up all planes, and those to trace all rays."""
    from lenstronomy.LensModel.MultiPlane.multi_plane import MultiPlane

    start = time.perf_counter()
    models, redshifts, kwargs = [], [], []
    for z, x, y, r_s, alpha_rs in zip(*(haloes[name] for name in COLUMNS)):
        _, kappa = numpy_multiplane.halo_radial(np.hypot(x, y), r_s, alpha_rs)
        models += ["NFW", "CONVERGENCE"]
        redshifts += [z, z]
        kwargs += [{"Rs": r_s, "alpha_Rs": alpha_rs, "center_x": x, "center_y": y}, {"kappa": -float(kappa)}]
    lens = MultiPlane(z_source, models, redshifts, cosmo=COSMOLOGY)
    ready = time.perf_counter()
    beta = np.array(lens.ray_shooting(*theta, kwargs))
    return beta, ready - start, time.perf_counter() - ready


def quantiles(label, differences):
    q50, q99, largest = np.quantile(np.abs(differences), [0.5, 0.99, 1.0])
    return f"| {label} | {q50:.1e} | {q99:.1e} | {largest:.1e} |"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--binary", required=True, help="the haloray command")
    parser.add_argument("--haloes", help="halo table (CSV) instead of a drawn cone")
    parser.add_argument("--rays", type=int, default=64, help="rays a side [64]")
    parser.add_argument("--half-width", type=float, default=2.5, help="half the field, arcsec [2.5]")
    parser.add_argument("--z-source", type=float, default=1.5)
    parser.add_argument("--summary", help="write a Markdown summary to this file")
    options = parser.parse_args()

    haloes = read_csv(options.haloes) if options.haloes else draw_cone(options.z_source)
    haloes = {name: haloes[name] for name in COLUMNS}
    side = np.linspace(-options.half_width, options.half_width, options.rays)
    theta_y, theta_x = (grid.ravel() for grid in np.meshgrid(side, side, indexing="ij"))
    number, origin = len(haloes["z"]), options.haloes or "a cone drawn by this script"
    print(f"{number} haloes ({origin}), {theta_x.size} rays")

    with tempfile.TemporaryDirectory() as folder:
        start = time.perf_counter()
        beta, jacobian = trace_with_haloray(
            options.binary, haloes, {"theta_x_arcsec": theta_x, "theta_y_arcsec": theta_y}, options.z_source,
            pathlib.Path(folder))
        haloray_seconds = time.perf_counter() - start
    start = time.perf_counter()
    numpy_beta, numpy_jacobian = trace_with_numpy(haloes, (theta_x, theta_y), options.z_source)
    numpy_seconds = time.perf_counter() - start
    print(f"haloray {haloray_seconds:.1f} s with its files, numpy {numpy_seconds:.0f} s")
    oracle_beta, setup_seconds, oracle_seconds = trace_with_lenstronomy(
        haloes, (theta_x, theta_y), options.z_source)

    lines = [
        "| difference | q50 | q99 | max |", "|---|---|---|---|",
        quantiles("β, haloray − lenstronomy (arcsec)", beta - oracle_beta),
        quantiles("β, haloray − numpy (arcsec)", beta - numpy_beta),
        quantiles("β, numpy − lenstronomy (arcsec)", numpy_beta - oracle_beta),
        quantiles("A, haloray − numpy", jacobian - numpy_jacobian), "",
        "| code | computes | seconds |", "|---|---|---|",
        f"| haloray | β and A, files written and read | {haloray_seconds:.2f} |",
        f"| numpy | β and A | {numpy_seconds:.1f} |",
        f"| lenstronomy | β | {oracle_seconds:.1f} (and {setup_seconds:.1f} to set up its planes) |",
    ]
    print("\n".join(lines))
    if options.summary:
        shown = [f"--haloes {options.haloes}"] if options.haloes else []
        shown += [f"--rays {options.rays}", f"--half-width {options.half_width}", f"--z-source {options.z_source}"]
        head = [
            f"{number:,} haloes ({origin}), one plane and one sheet each, {theta_x.size:,} rays over "
            f"±{options.half_width}″, source at z = {options.z_source}, exact recursion. haloray uses all cores, the "
            "other two one; seconds are of a single run.", ""]
        command = " ".join(["python3 data/oracle/compare_cone.py --binary haloray", *shown])
        page.write(options.summary, command, "\n".join(head + lines), ["lenstronomy", "astropy", "numpy"])


if __name__ == "__main__":
    main()
