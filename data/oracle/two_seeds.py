"""Two fits of each image of a catalogue, that differ in their seed alone: do their posteriors of gamma_LOS agree?

Run:   python3 two_seeds.py --binary ../../target/release/haloray --folder two_seeds --summary ../../docs/TWO_SEEDS.md
Needs: nothing but Python; fits that are in the folder already are read, not repeated
Units: shears without; differences in posterior standard deviations
"""

import argparse
import csv
import math
import pathlib
import statistics
import subprocess

import page

MODEL = "comprehensive"
FIT_SEEDS = (1, 2)


def run(*command):
    """1 is the code of a study with a fit that did not converge."""
    code = subprocess.run([str(part) for part in command], check=False).returncode
    assert code in (0, 1), f"{' '.join(map(str, command))} ended with {code}"


def fits(study):
    """The rows of `fits.csv` by the names of their images."""
    with open(study / "fits.csv", newline="") as file:
        return {row["image"]: row for row in csv.DictReader(line for line in file if not line.startswith("#"))}


class Pair:
    """One component of gamma_LOS in two fits of an image."""

    def __init__(self, rows, component):
        self.image, self.component = rows[0]["image"], component
        self.converged = all(float(row["converged"]) == 1.0 for row in rows)
        self.means = [float(row[f"gamma{component}_los_mean"]) for row in rows]
        self.deviations = [float(row[f"gamma{component}_los_sd"]) for row in rows]
        deviation = math.sqrt(statistics.fmean(sd * sd for sd in self.deviations))
        self.difference = (self.means[1] - self.means[0]) / deviation
        # The effective size of the least effective parameter stands for this one's.
        self.expected = math.sqrt(sum(1.0 / float(row["worst_ess"]) for row in rows))

    def row(self):
        note = "" if self.converged else " (not converged)"
        values = " | ".join(f"{mean:.4f} ± {sd:.4f}" for mean, sd in zip(self.means, self.deviations))
        return (f"| {self.image.removeprefix('images/')}{note} | γ{self.component} | {values} "
                f"| {self.difference:.2f} | {self.expected:.2f} |")


def table(pairs, seed):
    """Markdown: how the differences are distributed, and the five largest."""
    settled = [pair for pair in pairs if pair.converged]
    sizes = sorted(abs(pair.difference) for pair in settled)
    ratios = [abs(math.log(pair.deviations[1] / pair.deviations[0])) for pair in settled]
    beyond = sum(abs(pair.difference) > 3.0 * pair.expected for pair in settled)
    lines = [
        f"`mock --seed {seed}`: {len(pairs) // 2} images, {len(settled) // 2} of which converge with both seeds. For these the means of a component differ by "
        f"{statistics.median(sizes):.3f} σ in the median, {sizes[int(0.95 * len(sizes))]:.2f} σ in one of twenty, {sizes[-1]:.2f} σ at most "
        f"(root mean square {math.sqrt(statistics.fmean(x * x for x in sizes)):.3f}); {beyond} of {len(sizes)} by more than three times what the effective size lets expect. "
        f"Standard deviations differ by {100 * math.expm1(statistics.median(ratios)):.1f}% in the median, {100 * math.expm1(max(ratios)):.0f}% at most. "
        "The largest differences:",
        "",
        "| image | component | first seed | second seed | difference, σ | expected, σ |",
        "|---|---|---:|---:|---:|---:|",
    ]
    furthest = sorted(pairs, key=lambda pair: -abs(pair.difference))[:5]
    unsettled = [pair for pair in pairs if not pair.converged and pair not in furthest]
    return "\n".join(lines + [pair.row() for pair in furthest + unsettled])


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--binary", required=True)
    parser.add_argument("--seeds", type=int, nargs="+", default=[201], help="of the catalogues")
    parser.add_argument("--first", type=int, default=40, help="so many images of each")
    parser.add_argument("--folder", type=pathlib.Path, required=True)
    parser.add_argument("--summary", type=pathlib.Path, required=True)
    options = parser.parse_args()
    options.folder.mkdir(parents=True, exist_ok=True)
    tables = []
    for seed in options.seeds:
        catalogue = options.folder / f"mock{seed}"
        if not catalogue.exists():
            run(options.binary, "mock", "-n", 64, "--seed", seed, "-o", catalogue)
        studies = [options.folder / f"mock{seed}_fits{fit_seed}" for fit_seed in FIT_SEEDS]
        for study, fit_seed in zip(studies, FIT_SEEDS):
            run(options.binary, "study", "catalogue", catalogue, "--models", MODEL, "--first", options.first, "--seed", fit_seed, "-o", study)
        first, second = map(fits, studies)
        both = sorted(first.keys() & second.keys())
        pairs = [Pair((first[image], second[image]), component) for image in both for component in (1, 2)]
        tables.append(table(pairs, seed))
    page.write(options.summary, "just two-seeds", "\n\n".join(tables))


if __name__ == "__main__":
    main()
