#!/usr/bin/env python3
"""Kills haloray at random moments and looks at what is left: `kills.py BINARY N [PAGE]`.

Every command runs once undisturbed for its bytes and its duration. Then N times: a command is started in a folder of its own, or
over what an earlier run left there, killed with SIGKILL at a random moment (seeded) of its duration, and its files are looked at: those of
no run, of the run before, or of the whole run. The same command is then run to its end: its bytes must be those of the undisturbed
run, and nothing may be left beside them. With PAGE the counts replace the section between `<!-- kills -->` and `<!-- /kills -->`.
"""

import hashlib
import pathlib
import random
import shutil
import subprocess
import sys
import tempfile
import time

SMALL = """[haloes]
min_point_shear = 1e-5
[image]
pixels = 12
[maps]
points = 9
"""
MODEL = """name = "small"
[line_of_sight]
model = "minimal"
[line_of_sight.parameters]
gamma1_los = { uniform = [-0.2, 0.2] }
gamma2_los = { uniform = [-0.2, 0.2] }
omega_los = 0.0
gamma1_od = 0.0
gamma2_od = 0.0
[[lens]]
profile = "SIE"
[lens.parameters]
theta_E = { uniform = [0.5, 2.5] }
e1 = { normal = [0.0, 0.1] }
e2 = { normal = [0.0, 0.1] }
[[source]]
profile = "SERSIC"
[source.parameters]
R_sersic = { log_normal = [0.3, 0.5] }
n_sersic = 2.0
center_x = { uniform = [-0.3, 0.3] }
center_y = { uniform = [-0.3, 0.3] }
"""
COMMANDS = {
    "simulate": "simulate small.toml -o out",
    "populate .csv": "populate small.toml -o out.csv",
    "populate .h5": "populate small.toml -o out.h5",
    "map": "map small.toml -o out",
    "image": "image small.toml -o out",
    "trace": "trace --haloes haloes.csv --points points.csv --z-source 1.5 -o out.csv",
    "fit": "fit in/image.fits --model model.toml --sampler stretch --max-draws 40 --pixel-sampling point -o out",
    "mock": "mock -n 6 -o out",
    "study tidal": "study tidal small.toml -n 4 -o out",
    "study cut": "study cut small.toml --cuts 1e-4,1e-5 -o out",
    "study haloes": "study haloes small.toml -n 2 -o out",
    "ensemble": "ensemble small.toml -n 6 -o out",
    "study calibration": "study calibration -n 2 -o out",
    "study catalogue": "study catalogue mine --models model.toml --sampler stretch --max-draws 40 --pixel-sampling point -o out",
}
# What differs between equal runs.
TIMES = {"timings.json"}


def files(folder):
    """Bytes of what a user sees, and the hidden names."""
    seen, hidden = {}, []
    for path in sorted(folder.rglob("*")):
        name = str(path.relative_to(folder))
        if not name.startswith("out") and not name.startswith("."):
            continue
        if any(part.startswith(".") for part in path.relative_to(folder).parts):
            hidden.append(name)
        elif path.is_file() and path.name not in TIMES and "/fits/" not in name:
            seen[name] = hashlib.sha256(path.read_bytes()).hexdigest()
    return seen, hidden


def main():
    binary, number = str(pathlib.Path(sys.argv[1]).resolve()), int(sys.argv[2])
    rng = random.Random(1)
    base = pathlib.Path(tempfile.mkdtemp(prefix="kills-"))

    def run(folder, command, limit=None):
        with subprocess.Popen(
            [binary, *command.split(), "--quiet", "--threads", "1"],
            cwd=folder,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
        ) as process:
            try:
                stderr = process.communicate(timeout=limit)[1]
                return process.returncode, stderr.decode()
            except subprocess.TimeoutExpired:
                process.kill()
                process.communicate()
                return None, ""

    common = base / "common"
    common.mkdir()
    (common / "small.toml").write_text(SMALL)
    (common / "model.toml").write_text(MODEL)
    (common / "points.csv").write_text(
        "theta_x_arcsec,theta_y_arcsec\n" + "".join(f"{i / 100},{1 - i / 80}\n" for i in range(200))
    )
    for command in ("populate small.toml -o haloes.csv", "image small.toml -o in"):
        assert run(common, command)[0] == 0, command
    # A catalogue of one small image.
    (common / "mine").mkdir()
    shutil.copy(common / "in" / "image.fits", common / "mine")
    (common / "mine" / "truth.csv").write_text("image,gamma1_los,gamma2_los\nimage.fits,0.01,0.02\n")

    tried, faults, counts = {}, [], {}
    for name, command in COMMANDS.items():
        folder = base / name.replace(" ", "-")
        shutil.copytree(common, folder)
        start = time.monotonic()
        code, stderr = run(folder, command)
        duration = time.monotonic() - start
        if code not in (0, 1) or "panicked" in stderr:
            faults.append(f"{name}: exit {code}: {stderr.strip()}")
            continue
        whole, hidden = files(folder)
        if hidden or not whole:
            faults.append(f"{name}: {len(whole)} files, hidden {hidden}")
        tried[name] = (command, duration, whole)
        counts[name] = dict.fromkeys(("kills", "nothing", "former", "whole", "finished by the next run"), 0)

    for k in range(number):
        name = list(tried)[k % len(tried)]
        command, duration, whole = tried[name]
        folder = base / f"{name.replace(' ', '-')}-killed"
        # Every other time over the former run, whose files have other bytes where the seed enters.
        if k // len(tried) % 2 == 0 or not folder.exists():
            shutil.rmtree(folder, ignore_errors=True)
            shutil.copytree(common, folder)
        before = files(folder)[0]
        # Half of the kills fall into the last tenth, where files get their names.
        limit = duration * (rng.uniform(0.9, 1.05) if rng.random() < 0.5 else rng.random())
        code, _ = run(folder, command, limit)
        seen, _ = files(folder)
        count = counts[name]
        count["kills"] += code is None
        if not seen:
            count["nothing"] += 1
        elif seen == whole:
            count["whole"] += 1
        elif seen == before:
            count["former"] += 1
        elif before:
            count["finished by the next run"] += 1
        else:
            faults.append(f"{name}: part of the files: {sorted(seen)}")
        code, stderr = run(folder, command)
        after, hidden = files(folder)
        if code not in (0, 1) or "panicked" in stderr or after != whole or hidden:
            differing = sorted(n for n in after.keys() | whole.keys() if after.get(n) != whole.get(n))
            faults.append(f"{name}: then exit {code}, differing {differing}, hidden {hidden}: {stderr.strip()[:300]}")
    shutil.rmtree(base)

    heads = ["command", "killed", "no file seen", "files of the run before", "all files", "finished by the next run"]
    lines = ["| " + " | ".join(heads) + " |", "|---" * len(heads) + "|"]
    keys = ("kills", "nothing", "former", "whole", "finished by the next run")
    lines += [f"| `{name}` | " + " | ".join(str(c[key]) for key in keys) + " |" for name, c in counts.items()]
    total = sum(c["kills"] for c in counts.values())
    lines.append(f"\n{total} kills; {len(faults)} left part of a set of files, litter after the next run, or other bytes at the end.")
    text = "\n".join(lines)
    print(text, *faults, sep="\n")
    if len(sys.argv) > 3:
        page = pathlib.Path(sys.argv[3])
        before, rest = page.read_text().split("<!-- kills -->")
        page.write_text(f"{before}<!-- kills -->\n\n{text}\n\n<!-- /kills -->{rest.split('<!-- /kills -->')[1]}")
    sys.exit(bool(faults))


if __name__ == "__main__":
    main()
