"""The closure of the whole chain: images of `haloray simulate` fitted through their own haloes, beside tidal fits.

Run:   python3 closure.py --binary ../../target/release/haloray --seeds 10 --folder closure --summary ../../docs/CLOSURE.md
Needs: nothing but Python; runs that are in the folder already are read, not repeated
Units: chi2 per degree of freedom
"""

import argparse
import math
import pathlib

import page
from simulated_runs import fit, simulated

PIXELS = 64 * 64


def fitted(run, image, model):
    """Summary of one fit, and how many of its parameters hold the expected value in their 68% interval."""
    summary, rows = fit(run, image, model)
    held = sum(float(r["hpd68_low"]) <= float(r["expected_on_axis"]) <= float(r["hpd68_high"]) for r in rows)
    return summary, held, len(rows)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--binary", required=True)
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--folder", type=pathlib.Path, required=True)
    parser.add_argument("--summary", type=pathlib.Path, required=True)
    options = parser.parse_args()
    lines = [
        "| seed | image | χ², tidal model | χ², through its haloes | 68% intervals that hold the truth | error of β, arcsec |",
        "|---:|---|---:|---:|---:|---:|",
    ]
    worst, held_all, all_parameters = 0.0, 0, 0
    for seed in range(1, options.seeds + 1):
        run = simulated(options.binary, options.folder, "paper", seed, "tidal-minimal,haloes")
        for image in ("all_haloes", "tidal_haloes"):
            tidal, _, _ = fitted(run, image, "tidal-minimal")
            through, held, parameters = fitted(run, image, "haloes")
            note = "" if through["converged"] else " (not converged)"
            worst = max(worst, abs(through["chi2_reduced"] - 1.0))
            held_all, all_parameters = held_all + held, all_parameters + parameters
            lines.append(
                f"| {seed} | {image.replace('_', ' ')} | {tidal['chi2_reduced']:.3f} | {through['chi2_reduced']:.3f}{note} "
                f"| {held} of {parameters} | {through['expansion_error_arcsec']:.1e} |"
            )
    noise = 3.0 * math.sqrt(2.0 / PIXELS)
    share = held_all / all_parameters
    lines.append(
        f"\nThrough the haloes χ² differs from 1 by {worst:.3f} at most; noise alone stays within {noise:.3f} in 997 of 1000 images. "
        f"{held_all} of {all_parameters} intervals ({100 * share:.0f}%) hold the true lens and source, where 68% are meant to."
    )
    page.write(options.summary, "just closure", "\n".join(lines))


if __name__ == "__main__":
    main()
