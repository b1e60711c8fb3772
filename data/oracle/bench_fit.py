"""Fits one lenstronomy image with haloray and with emcee on lenstronomy's likelihood; times both beside each other.

Needs: pip install lenstronomy==1.14.2 emcee astropy numpy
Run:   python3 bench_fit.py --binary haloray --bench fit-benchmark --minutes 5 --summary FIT.md

The image is that of Table 1 (49 x 49 pixels of 0.08 arcsec) made by lenstronomy with noise of numpy and a seed of its
own. Both sides use lenstronomy's likelihood, one point a pixel, and the uniform priors of simple-minimal. The times of
one call alternate in the same run; lenstronomy's linear algebra is held to one core. `--bench` is the executable of
`cargo bench --bench fit --no-run`. emcee runs 10 walkers a parameter for the stated minutes in two processes.
"""

import argparse
import json
import multiprocessing
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import time

os.environ.setdefault("OMP_NUM_THREADS", "1")
import emcee
import numpy as np
from astropy.io import fits

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "reference"))
import make_likelihood as table1
import page

SAMPLERS = ("valley", "nuts", "ensemble-slice", "stretch", "nested")
NAMES = list(table1.TRUTH)
LOW = {"lens.theta_E": 0.01, "lens.gamma": 1.0, "source.R_sersic": 0.001, "source.n_sersic": 0.5,
       "lens_light.R_sersic": 0.001, "lens_light.n_sersic": 0.5, "source.center_x": -0.1, "source.center_y": -0.1}
HIGH = {"lens.theta_E": 10.0, "lens.gamma": 3.0, "source.R_sersic": 10.0, "source.n_sersic": 5.0,
        "lens_light.R_sersic": 10.0, "lens_light.n_sersic": 5.0, "source.center_x": 0.1, "source.center_y": 0.1}
EDGES = np.array([[LOW.get(name, -0.5), HIGH.get(name, 0.5)] for name in NAMES])
SHEARS = ("gamma1_los", "gamma2_los")
MODEL = None


def log_probability(x):
    if np.any(x <= EDGES[:, 0]) or np.any(x >= EDGES[:, 1]):
        return -np.inf
    lens, source, light = table1.keywords(dict(zip(NAMES, map(float, x))))
    try:
        value = MODEL.likelihood_data_given_model(lens, source, light)[0]
    except (np.linalg.LinAlgError, ValueError):
        return -np.inf
    return value if np.isfinite(value) else -np.inf


def write_image(path, data):
    hdu = fits.PrimaryHDU(data.reshape(table1.PIXELS, table1.PIXELS))
    for axis in "12":
        hdu.header["CDELT" + axis] = table1.SCALE / 3600
    hdu.header["EXPTIME"], hdu.header["BKGRMS"] = table1.EXPOSURE, table1.BACKGROUND
    hdu.header["PSFFWHM"], hdu.header["PSFTRUNC"] = 0.08, 5.0
    hdu.writeto(path)


def timed_calls(points, calls=150):
    start = time.perf_counter()
    for i in range(calls):
        log_probability(points[i % len(points)])
    return (time.perf_counter() - start) / calls


def divan_medians(executable):
    """Median seconds of value, value_and_gradient and fisher_matrix with lenstronomy's likelihood."""
    text = subprocess.run([executable, "--bench"], capture_output=True, text=True, check=True).stdout
    units, found, group = {"ns": 1e-9, "µs": 1e-6, "ms": 1e-3, "s": 1.0}, {}, None
    for line in text.splitlines():
        head = re.match(r"[├╰]─ (\w+)", line)
        group = head.group(1) if head else group
        row = re.search(r"─ (gaussian|lenstronomy)\s+(.*)", line)
        if row:
            value, unit = row.group(2).split("│")[2].split()
            found[group, row.group(1)] = float(value) * units[unit]
    return found


def haloray(binary, image, folder, sampler, min_ess):
    out = pathlib.Path(folder) / sampler
    command = [binary, "fit", image, "--likelihood", "lenstronomy", "--pixel-sampling", "point", "--model",
               "simple-minimal", "--sampler", sampler, "-o", str(out), "--quiet", "--min-ess", str(min_ess)]
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode not in (0, 1):
        raise SystemExit(done.stderr)
    summary = json.loads((out / "summary.json").read_text())
    return {"summary": summary} | {p["name"]: p for p in summary["parameters"]}


def run_emcee(start, widths, minutes, rng):
    walkers = 10 * len(NAMES)
    places = start + widths * rng.standard_normal((walkers, len(NAMES)))
    with multiprocessing.get_context("fork").Pool(2) as pool:
        sampler = emcee.EnsembleSampler(walkers, len(NAMES), log_probability, pool=pool)
        begun = time.perf_counter()
        for step, _ in enumerate(sampler.sample(places, iterations=100_000), 1):
            if time.perf_counter() - begun > 60 * minutes:
                break
    seconds = time.perf_counter() - begun
    tau = sampler.get_autocorr_time(quiet=True, tol=0)
    burn = step // 4
    chain = sampler.get_chain(discard=burn, flat=True)
    effective = {name: chain.shape[0] / tau[i] for i, name in enumerate(NAMES)}
    return {"steps": step, "walkers": walkers, "seconds": seconds, "tau": dict(zip(NAMES, tau)), "burn": burn,
            "ess": effective, "mean": dict(zip(NAMES, chain.mean(0))), "sd": dict(zip(NAMES, chain.std(0)))}


def main():
    global MODEL
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--binary", required=True)
    arguments.add_argument("--bench")
    arguments.add_argument("--minutes", type=float, default=5.0)
    arguments.add_argument("--seed", type=int, default=77)
    arguments.add_argument("--samplers", default=",".join(SAMPLERS))
    arguments.add_argument("--min-ess", type=float, default=400, help="effective draws that haloray's fits go on to")
    arguments.add_argument("--summary", required=True)
    options = arguments.parse_args()
    rng = np.random.default_rng(options.seed)
    data = table1.noisy_image(rng)
    MODEL = table1.image_model(data.reshape(table1.PIXELS, table1.PIXELS))
    truth = np.array([table1.TRUTH[name] for name in NAMES])
    command = "python3 data/oracle/bench_fit.py " + " ".join(
        f"--{k.replace('_', '-')} {pathlib.Path(str(v)).name if k in ('binary', 'bench') else v}"
        for k, v in vars(options).items() if v is not None and k != "summary")
    lines = [f"Image of Table 1 by lenstronomy, noise of numpy, seed {options.seed}. Load average at the start "
             f"{os.getloadavg()[0]:.1f}.", ""]

    def save():
        page.write(options.summary, command, "\n".join(lines), ["lenstronomy", "emcee", "numpy"])

    if options.bench:
        widths = np.array([table1.WIDTH[name] for name in NAMES])
        points = truth + 1e-3 * widths * rng.standard_normal((20, len(NAMES)))
        theirs, ours = [], []
        for _ in range(3):
            theirs.append(timed_calls(points))
            ours.append(divan_medians(options.bench))
        best = {key: min(o[key] for o in ours) for key in ours[0]}
        value, gradient = best["value", "lenstronomy"], best["value_and_gradient", "lenstronomy"]
        lines += ["### One log-likelihood on one core", "",
                  "Best of three alternating rounds (150 calls of lenstronomy; medians of divan).", "",
                  "| what | time | ratio |", "|---|---|---|",
                  f"| lenstronomy, value | {1e3 * min(theirs):.3f} ms | 1 |",
                  f"| haloray, lenstronomy's likelihood, value | {1e3 * value:.4f} ms | {min(theirs) / value:.1f} times faster |",
                  f"| haloray, value and gradient | {1e3 * gradient:.4f} ms | {gradient / value:.1f} calls |",
                  f"| haloray, its own likelihood, value | {1e3 * best['value', 'gaussian']:.4f} ms | "
                  f"{min(theirs) / best['value', 'gaussian']:.1f} times faster |",
                  f"| haloray, its own, value and gradient | {1e3 * best['value_and_gradient', 'gaussian']:.4f} ms | "
                  f"{best['value_and_gradient', 'gaussian'] / best['value', 'gaussian']:.1f} calls |", ""]
        save()
        print("\n".join(lines), flush=True)

    with tempfile.TemporaryDirectory() as folder:
        image = str(pathlib.Path(folder) / "image.fits")
        write_image(image, data)
        found = {}
        for sampler in options.samplers.split(","):
            found[sampler] = haloray(options.binary, image, folder, sampler, options.min_ess)
            s = found[sampler]["summary"]
            print(sampler, s["seconds"], s["worst_ess"], s["worst_r_hat"], flush=True)
    first, ours = next(iter(found.items()))
    width = np.array([ours[name]["standard_deviation"] for name in NAMES])
    theirs = run_emcee(truth, width, options.minutes, rng)
    lines += ["### The same posterior", "", "Lenstronomy's likelihood on both sides; emcee starts at the truth, spread "
              f"by one standard deviation, {theirs['walkers']} walkers, {theirs['steps']} steps, first {theirs['burn']} "
              "left out. Shifts are in standard deviations of the first row.", "",
              "| sampler | γ1_LOS | σ | γ2_LOS | σ | shift γ1, γ2 (σ) | σ ratio γ1, γ2 | ESS (γ1, γ2) | worst R-hat | seconds |",
              "|---|---|---|---|---|---|---|---|---|---|"]
    a, b = (ours[name] for name in SHEARS)
    reference = [(p["mean"], p["standard_deviation"]) for p in (a, b)]

    def row(name, means, sds, ess, r_hat, seconds):
        shift = ", ".join(f"{(m - r[0]) / r[1]:+.3f}" for m, r in zip(means, reference))
        ratio = ", ".join(f"{s / r[1]:.3f}" for s, r in zip(sds, reference))
        return (f"| {name} | {means[0]:.5f} | {sds[0]:.5f} | {means[1]:.5f} | {sds[1]:.5f} | {shift} | {ratio} | "
                f"{ess[0]:.0f}, {ess[1]:.0f} | {r_hat} | {seconds:.1f} |")

    for sampler, result in found.items():
        p = [result[name] for name in SHEARS]
        s = result["summary"]
        lines.append(row("haloray " + sampler + ("" if s["converged"] else " (not converged)"), [q["mean"] for q in p],
                         [q["standard_deviation"] for q in p], [q["ess_bulk"] for q in p], f"{s['worst_r_hat']:.4f}",
                         s["seconds"]))
    lines.append(row("emcee on lenstronomy", [theirs["mean"][n] for n in SHEARS], [theirs["sd"][n] for n in SHEARS],
                     [theirs["ess"][n] for n in SHEARS], "", theirs["seconds"]))
    our_rate = min(a["ess_bulk"], b["ess_bulk"]) / ours["summary"]["seconds"]
    their_rate = min(theirs["ess"][n] for n in SHEARS) / theirs["seconds"]
    tau = max(theirs["tau"][n] for n in SHEARS)
    lines += ["", "### Effective draws of γ_LOS a second", "",
              f"haloray (start and warm-up included): {our_rate:.1f}; emcee (autocorrelation time {tau:.0f} steps, "
              f"{theirs['steps'] / tau:.0f} of them run; burn-in time included, its draws not): {their_rate:.3f}; ratio "
              f"{our_rate / their_rate:.0f}.", "",
              f"### Every parameter: haloray {first} against emcee", "", "| parameter | shift of the mean (σ) | ratio of σ |",
              "|---|---|---|"]
    for name in NAMES:
        p = ours[name]
        lines.append(f"| {name} | {(theirs['mean'][name] - p['mean']) / p['standard_deviation']:+.3f} | "
                     f"{theirs['sd'][name] / p['standard_deviation']:.3f} |")
    save()
    print("\n".join(lines))


if __name__ == "__main__":
    main()
