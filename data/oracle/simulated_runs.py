"""Runs of `haloray simulate` with fits, one folder for each seed; what is there already is read, not repeated."""

import csv
import json
import subprocess


def simulated(binary, folder, preset, seed, models="tidal-minimal"):
    """The folder of one run, made first where it is missing; 1 is the code of a fit that did not converge."""
    run = folder / preset / f"seed{seed}"
    if not (run / "recovered_shears.csv").exists():
        run.parent.mkdir(parents=True, exist_ok=True)
        command = [binary, "simulate", "--preset", preset, "--seed", str(seed), "--fit", models, "--no-figures", "-q", "-o", str(run)]
        code = subprocess.run(command, check=False).returncode
        assert code in (0, 1), f"{' '.join(command)} ended with {code}"
    return run


def fit(run, image, model):
    """Summary of one fit, and its rows of `recovered_shears.csv`."""
    summary = json.loads((run / f"fit_{image}_{model}" / "summary.json").read_text())
    with open(run / "recovered_shears.csv", newline="") as table:
        rows = [row for row in csv.DictReader(table) if row["image"] == image and row["model"] == model]
    return summary, rows
