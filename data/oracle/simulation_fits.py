"""Do fits of simulated images find the highest maximum? `simulate --fit` of many seeds, each fit beside a climb from the truth.

Run:   python3 simulation_fits.py --binary ../../target/release/haloray --presets paper:25,consistent:12 --folder simulation_fits --summary ../../docs/SIMULATION_FITS.md
Needs: nothing but Python; runs that are in the folder already are read, not repeated
Units: chi2 per degree of freedom; gamma_LOS less that on the axis in units of its own 68% half width, the larger of two components
"""

import argparse
import pathlib
import statistics

import page
from simulated_runs import fit, simulated

MODEL = "tidal-minimal"
WHAT = {"tidal_haloes": "haloes in the tidal regime", "all_haloes": "all haloes"}


def errors_off(rows):
    """By how many of its own errors the fitted gamma_LOS is off that on the axis, in the worse component."""
    shears = [{name: float(row[name]) for name in ("median", "hpd68_low", "hpd68_high", "expected_on_axis")}
              for row in rows if row["parameter"] in ("gamma1_los", "gamma2_los")]
    assert len(shears) == 2
    return max(2.0 * abs(s["median"] - s["expected_on_axis"]) / (s["hpd68_high"] - s["hpd68_low"]) for s in shears)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--binary", required=True)
    parser.add_argument("--presets", default="paper:60,consistent:60", help="presets, each with the number of its seeds, from 1")
    parser.add_argument("--folder", type=pathlib.Path, required=True)
    parser.add_argument("--summary", type=pathlib.Path, required=True)
    options = parser.parse_args()
    lines = [
        "| preset | image | fits | converged | describe their image | χ²: median, largest | γ_LOS off the axis, in errors: median, largest "
        "| below a climb from the truth | evaluations: median, largest |",
        "|---|---|---:|---:|---:|---:|---:|---:|---:|",
    ]
    missed = []
    for preset, seeds in (part.split(":") for part in options.presets.split(",")):
        fits = {image: [] for image in WHAT}
        for seed in range(1, int(seeds) + 1):
            run = simulated(options.binary, options.folder, preset, seed)
            for image in WHAT:
                summary, rows = fit(run, image, MODEL)
                higher = float(rows[0]["truth_climbs_higher_by"])
                fits[image].append((summary, higher > 1.0, errors_off(rows)))
                if higher > 1.0:
                    missed.append(f"{preset}, seed {seed}, {WHAT[image]}: by {higher:.1f} in ln p, χ² {summary['chi2_reduced']:.3f}")
            print(preset, seed, flush=True)
        for image, what in WHAT.items():
            summaries, lower, off = zip(*fits[image])
            numbers = lambda name: [summary[name] for summary in summaries]
            both = lambda values, form: f"{statistics.median(values):{form}}, {max(values):{form}}"
            lines.append(
                f"| {preset} | {what} | {len(summaries)} | {sum(numbers('converged'))} | {sum(numbers('good_fit'))} "
                f"| {both(numbers('chi2_reduced'), '.2f')} | {both(off, '.1f')} | {sum(lower)} | {both(numbers('evaluations'), ',.0f')} |"
            )
    lines.append("\nBelow a climb from the truth: " + ("; ".join(missed) if missed else "none") + ".")
    page.write(options.summary, f"just simulation-fits {options.presets}", "\n".join(lines))


if __name__ == "__main__":
    main()
