"""A fake light cone of many haloes: sightlines that `haloray extract` takes from it against brute force, seconds and memory.

Run:   python3 lightcone.py --binary ../../target/release/haloray --haloes 100000000 --summary ../../docs/howto/lightcone.md
Needs: numpy, h5py; 24 bytes of disk a halo
Units: degrees, Msun, comoving Mpc

Haloes are uniform in comoving volume over the whole sky to z = 1.6, their masses follow dn/dM ~ M^-1.9 from 1e11 Msun; the file
is one of plain HDF5 datasets. Brute force looks at every halo for every sampled sightline with formulas of its own.
"""

import argparse
import csv
import os
import pathlib
import shutil
import sys
import time

import h5py
import numpy as np

from page import processor

SPEED_OF_LIGHT, H0, OMEGA_M, RADIUS, Z_MAX = 299_792.458, 67.4, 0.315, 18.46, 1.6
CHUNK = 5_000_000
Z_SOURCE = 1.5
# Of a radius: haloes nearer than this to the edge of a cylinder may lie on either side of it.
EDGE = 1e-9


def chi_of(z, steps=64):
    """Comoving distances by Gauss-Legendre quadrature."""
    nodes, weights = np.polynomial.legendre.leggauss(steps)
    z = np.asarray(z, dtype=np.float64)
    at = 0.5 * z[..., None] * (nodes + 1.0)
    inverse = 1.0 / np.sqrt(OMEGA_M * (1.0 + at) ** 3 + 1.0 - OMEGA_M)
    return SPEED_OF_LIGHT / H0 * 0.5 * z * (inverse @ weights)


def make(path, number, seed):
    """Writes the light cone, a chunk at a time, each from a generator of its own."""
    grid = np.linspace(0.0, Z_MAX, 20_001)
    volume = chi_of(grid) ** 3
    kinds = {"ra_deg": ("f8", "deg"), "dec_deg": ("f8", "deg"), "z": ("f4", None), "m200c_msun": ("f4", "solMass")}
    with h5py.File(path, "w") as file:
        group = file.create_group("haloes")
        for name, (kind, unit) in kinds.items():
            dataset = group.create_dataset(name, (number,), dtype=kind)
            if unit:
                dataset.attrs["unit"] = unit
        for start in range(0, number, CHUNK):
            stop = min(start + CHUNK, number)
            rng = np.random.default_rng([seed, start])
            size = stop - start
            group["ra_deg"][start:stop] = rng.uniform(0.0, 360.0, size)
            group["dec_deg"][start:stop] = np.degrees(np.arcsin(rng.uniform(-1.0, 1.0, size)))
            z = np.interp(rng.uniform(0.0, volume[-1], size), volume, grid)
            group["z"][start:stop] = np.maximum(z, 1e-4)
            group["m200c_msun"][start:stop] = np.minimum(1e11 * rng.uniform(1e-6, 1.0, size) ** (-1.0 / 0.9), 3e15)


def unit_vectors(ra_deg, dec_deg):
    ra, dec = np.radians(ra_deg), np.radians(dec_deg)
    return np.cos(dec) * np.cos(ra), np.cos(dec) * np.sin(ra), np.sin(dec)


def extract(binary, cone, folder, sightlines):
    """Runs the command; seconds, those of the processor, and the largest resident memory in bytes."""
    shutil.rmtree(folder, ignore_errors=True)
    command = [binary, "extract", str(cone), "-n", str(sightlines), "--footprint", "full-sky", "--z-lens", "0.5", "--z-source",
               str(Z_SOURCE), "--set", f"haloes.radius_cmpc={RADIUS}", "--quiet", "-o", str(folder)]
    start = time.monotonic()
    process = os.posix_spawn(binary, command, os.environ)
    _, status, usage = os.wait4(process, 0)
    if status != 0:
        sys.exit(f"haloray extract ended with {os.waitstatus_to_exitcode(status)}")
    return time.monotonic() - start, usage.ru_utime + usage.ru_stime, usage.ru_maxrss * 1024


def compare(cone, folder, sample):
    """Haloes that brute force and the command agree upon, and what they do not."""
    with open(folder / "sightlines.csv", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    rows = rows[:: max(1, len(rows) // sample)][:sample]
    expected = [[] for _ in rows]
    with h5py.File(cone) as file:
        haloes = file["haloes"]
        for start in range(0, len(haloes["z"]), CHUNK):
            part = slice(start, start + CHUNK)
            z = haloes["z"][part].astype(np.float64)
            ra, dec, mass = haloes["ra_deg"][part], haloes["dec_deg"][part], haloes["m200c_msun"][part]
            x, y, w = unit_vectors(ra, dec)
            grid = np.linspace(0.0, Z_MAX, 4001)
            largest = np.minimum(1.001 * RADIUS / np.interp(z, grid, chi_of(grid)), np.radians(30.1))
            cosine = np.cos(largest)
            for row, found in zip(rows, expected):
                a, b, c = unit_vectors(float(row["ra_deg"]), float(row["dec_deg"]))
                near = np.flatnonzero((x * a + y * b + w * c > cosine) & (z < Z_SOURCE))
                found.append((start + near, ra[near], dec[near], z[near], mass[near].astype(np.float64)))
    agreed = undecided = 0
    for row, parts in zip(rows, expected):
        number, ra, dec, z, mass = (np.concatenate(column) for column in zip(*parts))
        ra0, dec0, ra, dec = map(np.radians, (float(row["ra_deg"]), float(row["dec_deg"]), ra, dec))
        # Vincenty's separation and the position angle from north to east.
        east = np.cos(dec) * np.sin(ra - ra0)
        north = np.cos(dec0) * np.sin(dec) - np.sin(dec0) * np.cos(dec) * np.cos(ra - ra0)
        along = np.sin(dec0) * np.sin(dec) + np.cos(dec0) * np.cos(dec) * np.cos(ra - ra0)
        separation = np.arctan2(np.hypot(east, north), along)
        share = separation * chi_of(z) / RADIUS
        inside = (share <= 1.0) & (separation <= np.radians(30.0))
        on_edge = set(number[np.abs(share - 1.0) < EDGE])
        undecided += len(on_edge)
        with h5py.File(folder / row["file"]) as file:
            own = {name: file["haloes"][name][:] for name in file["haloes"]}
        own_rows = own["lightcone_row"].astype(np.int64)
        differing = set(number[inside]) ^ set(own_rows)
        if not differing <= on_edge:
            sys.exit(f"sightline {row['number']}: {len(differing)} haloes are not the same: {sorted(differing)[:5]}")
        place = {n: i for i, n in enumerate(number)}
        order = np.array([place[n] for n in own_rows], dtype=np.int64)
        angle = np.arctan2(east, north)[order]
        arcsec = np.degrees(separation[order]) * 3600.0
        wrong = max(np.abs(own["theta_x_arcsec"] + arcsec * np.sin(angle)).max(initial=0.0),
                    np.abs(own["theta_y_arcsec"] - arcsec * np.cos(angle)).max(initial=0.0))
        if wrong > 1e-6 or (own["z"] != z[order]).any() or (own["m200c_msun"] != mass[order]).any():
            sys.exit(f"sightline {row['number']}: positions differ by {wrong} arcsec, or redshifts or masses do")
        if not ((own["c200c"] > 1.0) & (own["c200c"] < 30.0)).all():
            sys.exit(f"sightline {row['number']}: concentrations that no halo has")
        agreed += len(own_rows)
    return len(rows), agreed, undecided


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--binary", required=True)
    parser.add_argument("--haloes", type=lambda text: int(float(text)), default=1_000_000)
    parser.add_argument("--sightlines", type=int, default=1000)
    parser.add_argument("--sample", type=int, default=20)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--folder", type=pathlib.Path, default=pathlib.Path("target/lightcone"))
    parser.add_argument("--summary", type=pathlib.Path)
    options = parser.parse_args()
    options.folder.mkdir(parents=True, exist_ok=True)
    cone, out = options.folder / "cone.h5", options.folder / "sightlines"
    make(cone, options.haloes, options.seed)
    seconds, computing, memory = extract(options.binary, cone, out, options.sightlines)
    sampled, agreed, undecided = compare(cone, out, options.sample)
    on_disk = sum(path.stat().st_size for path in out.rglob("*") if path.is_file())
    text = (
        f"{options.haloes:,} haloes over the whole sky ({cone.stat().st_size / 1e9:.2f} GB of HDF5), {options.sightlines:,} "
        f"sightlines of {RADIUS} Mpc to z = {Z_SOURCE}: **{seconds:.0f} seconds, {memory / 1e9:.2f} GB of memory**, {computing:.0f} "
        f"seconds of one core's time, "
        f"{on_disk / 1e6:.0f} MB written ({processor()}).\n\nBrute force over all haloes for {sampled} of the sightlines finds the same "
        f"{agreed:,} haloes, at the same places to 1e-6″; {undecided} lie within {EDGE:g} of a radius of an edge."
    )
    print(text)
    if options.summary:
        page = options.summary.read_text(encoding="utf-8")
        before, rest = page.split("<!-- lightcone -->")
        after = rest.split("<!-- /lightcone -->")[1]
        options.summary.write_text(f"{before}<!-- lightcone -->\n\n{text}\n\n<!-- /lightcone -->{after}", encoding="utf-8")
    shutil.rmtree(options.folder)


if __name__ == "__main__":
    main()
