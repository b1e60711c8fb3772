"""Samples lenstronomy's likelihood of one image by nested sampling (nautilus) and compares haloray's samplers with it.

Needs: pip install lenstronomy==1.14.2 nautilus-sampler==1.0.6 emcee astropy numpy
Run:   python3 nested_lenstronomy.py --binary haloray --seed 101 --summary NESTED.md

The image, its noise, likelihood and priors are those of bench_fit.py, the noise of another seed. nautilus explores the
whole prior; neither side is told the truth. Shifts are in nautilus's standard deviations.
"""

import argparse
import pathlib
import tempfile
import time

import bench_fit as bench
import numpy as np
import page
from nautilus import Sampler


def prior(unit):
    return bench.EDGES[:, 0] + unit * (bench.EDGES[:, 1] - bench.EDGES[:, 0])


def log_likelihood(x):
    return max(bench.log_probability(x), -1e100)


def nested(seed, live, effective):
    begun = time.perf_counter()
    sampler = Sampler(prior, log_likelihood, n_dim=len(bench.NAMES), n_live=live, pool=2, seed=seed)
    sampler.run(n_eff=effective, discard_exploration=True, verbose=True)
    points, log_weights, _ = sampler.posterior()
    weights = np.exp(log_weights - log_weights.max())
    weights /= weights.sum()
    mean = weights @ points
    deviation = np.sqrt(weights @ (points - mean) ** 2)
    return mean, deviation, sampler.n_eff, sampler.n_like, time.perf_counter() - begun


def main():
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--binary", required=True)
    arguments.add_argument("--seed", type=int, default=101, help="of the image's noise and of nautilus")
    arguments.add_argument("--samplers", default="valley,nuts,ensemble-slice,stretch,nested")
    arguments.add_argument("--live", type=int, default=3000)
    arguments.add_argument("--effective", type=int, default=20_000, help="effective draws that nautilus goes on to")
    arguments.add_argument("--min-ess", type=float, default=2000, help="effective draws that haloray's fits go on to")
    arguments.add_argument("--summary", required=True)
    options = arguments.parse_args()
    table1 = bench.table1
    data = table1.noisy_image(np.random.default_rng(options.seed))
    bench.MODEL = table1.image_model(data.reshape(table1.PIXELS, table1.PIXELS))
    with tempfile.TemporaryDirectory() as folder:
        image = str(pathlib.Path(folder) / "image.fits")
        bench.write_image(image, data)
        found = {}
        for sampler in options.samplers.split(","):
            found[sampler] = bench.haloray(options.binary, image, folder, sampler, options.min_ess)
            print(sampler, found[sampler]["summary"]["seconds"], flush=True)
    mean, deviation, effective, calls, seconds = nested(options.seed, options.live, options.effective)
    command = (f"python3 data/oracle/nested_lenstronomy.py --binary haloray --seed {options.seed} --live {options.live} "
               f"--effective {options.effective} --min-ess {options.min_ess:.0f}")
    lines = [f"nautilus: {effective:.0f} effective draws, {calls:,} calls of lenstronomy, {seconds:.0f} s on two cores, "
             f"image of Table 1 by lenstronomy with noise of seed {options.seed}. Shifts are (haloray − nautilus)/σ, ratios "
             "haloray's σ over nautilus's.", "",
             "| parameter | nautilus | σ | " + " | ".join(f"{s}: shift, ratio" for s in found) + " |",
             "|---" * (3 + len(found)) + "|"]
    for i, name in enumerate(bench.NAMES):
        cells = [f"{(p['mean'] - mean[i]) / deviation[i]:+.3f}, {p['standard_deviation'] / deviation[i]:.3f}"
                 for p in (result[name] for result in found.values())]
        lines.append(f"| {name} | {mean[i]:.5f} | {deviation[i]:.5f} | " + " | ".join(cells) + " |")
    lines.append("| seconds | " + f"{seconds:.0f} | | " +
                 " | ".join(f"{r['summary']['seconds']:.1f}" + ("" if r["summary"]["converged"] else " (not converged)")
                            for r in found.values()) + " |")
    text = "\n".join(lines) + "\n"
    page.write(options.summary, command, text, ["lenstronomy", "nautilus-sampler", "numpy"])
    print(text)


if __name__ == "__main__":
    main()
