"""How fast ensembles are beside `haloray simulate -q`, and what they take of memory and disk.

Needs: nothing but Python
Run:   python3 bench_ensemble.py --binary ../../target/release/haloray --number 10000 --summary ../../docs/ENSEMBLE_SPEED.md
Units: none
"""

import argparse
import os
import pathlib
import shutil
import subprocess
import tempfile
import time

import page


def run(binary, arguments, folder):
    """Wall seconds, core seconds and the largest resident memory in MB of one command."""
    start = time.perf_counter()
    process = subprocess.Popen([binary, *arguments.split(), "--quiet"], cwd=folder)
    _, status, used = os.wait4(process.pid, 0)
    if status != 0:
        raise SystemExit(f"haloray {arguments} failed")
    return time.perf_counter() - start, used.ru_utime + used.ru_stime, used.ru_maxrss / 1024


def megabytes(folder):
    """Bytes below a folder, in MB."""
    return sum(path.stat().st_size for path in pathlib.Path(folder).rglob("*") if path.is_file()) / 1e6


def main():
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("--binary", required=True)
    arguments.add_argument("--number", type=int, default=10000)
    arguments.add_argument("--images", type=int, default=100)
    arguments.add_argument("--summary")
    options = arguments.parse_args()
    binary = str(pathlib.Path(options.binary).resolve())
    folder = tempfile.mkdtemp(prefix="ensemble")
    rows, simulations = [], 3
    try:
        single = [run(binary, f"simulate --sightline {k} -o run{k}", folder) for k in range(simulations)]
        rows.append(("`simulate`", simulations, sum(s[0] for s in single), sum(s[1] for s in single),
                     max(s[2] for s in single), megabytes(f"{folder}/run0") * simulations))
        for level, number in (("scalars", options.number), ("images", options.images)):
            wall, cores, memory = run(binary, f"ensemble -n {number} --level {level} -o {level}", folder)
            rows.append((f"`ensemble --level {level}`", number, wall, cores, memory, megabytes(f"{folder}/{level}")))
    finally:
        shutil.rmtree(folder)
    lines = [
        "| command | sightlines | s | core s | core ms a sightline | largest memory, MB | on disk, MB |",
        "|---|---|---|---|---|---|---|",
    ]
    for name, number, wall, cores, memory, disk in rows:
        lines.append(
            f"| {name} | {number} | {wall:.1f} | {cores:.1f} | {1000 * cores / number:.1f} | {memory:.0f} | {disk:.1f} |")
    ratio = rows[0][3] / rows[0][1] / (rows[1][3] / rows[1][1])
    hours = 1e6 * rows[1][3] / rows[1][1] / 3600
    lines += ["", f"Preset `paper`. The numbers of a sightline cost a {ratio:.0f}th of the core seconds of `simulate -q`. "
              f"A million of them would take {hours:.0f} core hours and {1e6 * rows[1][5] / rows[1][1] / 1e3:.1f} GB on disk."]
    result = "\n".join(lines) + "\n"
    print(result)
    if options.summary:
        page.write(options.summary, "just bench-ensemble", result)


if __name__ == "__main__":
    main()
