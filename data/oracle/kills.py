#!/usr/bin/env python3
"""Kills haloray at random moments and looks at what is left: `kills.py BINARY N [PAGE]`.

Every command runs once undisturbed for its bytes and its duration, and once with other settings, whose files stand for an earlier run.
Then N times: the command is started in a folder of its own, or over the files of the earlier run, killed with SIGKILL at a random
moment (seeded) of its duration, and the files are looked at: none, those of the earlier run, or the whole run's. The same command is then
run to its end: its bytes must be those of the undisturbed run, and nothing may be left beside them. As many kills at a time as there are
cores. With PAGE the counts replace the section between `<!-- kills -->` and `<!-- /kills -->`.
"""

import concurrent.futures
import datetime
import hashlib
import os
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
LENSES = """name,z_lens,z_source,theta_E_arcsec
one,0.4,1.2,1.0
two,0.6,1.8,0.8
"""
FIT = "--sampler stretch --max-draws 40 --pixel-sampling point"
# The command that is killed, and what an earlier run differed by.
COMMANDS = {
    "simulate": ("simulate small.toml -o out", "--seed 7"),
    "populate .csv": ("populate small.toml -o out.csv", "--seed 7"),
    "populate .h5": ("populate small.toml -o out.h5", "--seed 7"),
    "map": ("map small.toml -o out", "--seed 7"),
    "image": ("image small.toml -o out", "--seed 7"),
    "trace": ("trace --haloes haloes.csv --points points.csv --z-source 1.5 -o out.csv", "--order 1"),
    "fit": (f"fit in/image.fits --model model.toml {FIT} -o out", "--seed 7"),
    "mock": ("mock -n 6 -o out", "--seed 7"),
    "ensemble": ("ensemble small.toml -n 6 -o out", "--seed 7"),
}
for study, rest in {
    "tidal": "small.toml -n 4",
    "cut": "small.toml --cuts 1e-4,1e-5",
    "haloes": "small.toml -n 2",
    "which-shear": "small.toml --set image.pixels=48 -n 1",
    "validity": "small.toml -n 2 --views all --models tidal-minimal --starts truth --estimate laplace --no-delays",
    "expected": "small.toml --lenses lenses.csv -n 3",
    "calibration": "-n 2",
    "catalogue": f"mine --models model.toml {FIT}",
}.items():
    COMMANDS[f"study {study}"] = (f"study {study} {rest} -o out", "--seed 7")
COMMANDS["extract"] = ("extract cone.csv -n 4 --z-lens 0.5 --z-source 1.5 -o out", "--seed 7")
# What differs between equal runs.
TIMES = {"timings.json"}


def files(folder):
    """Bytes of what a user sees, and the hidden names."""
    seen, hidden = {}, []
    for path in sorted(folder.rglob("*")):
        relative = path.relative_to(folder)
        if not relative.parts[0].startswith(("out", ".")):
            continue
        if any(part.startswith(".") for part in relative.parts):
            hidden.append(str(relative))
        elif path.is_file() and path.name not in TIMES and "fits" not in relative.parts:
            seen[str(relative)] = hashlib.sha256(path.read_bytes()).hexdigest()
    return seen, hidden


def run(binary, folder, command, limit=None):
    """Exit code, None where `limit` seconds were over first, and stderr."""
    with subprocess.Popen(
        [binary, *command.split(), "--quiet", "--threads", "1"], cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE
    ) as process:
        try:
            stderr = process.communicate(timeout=limit)[1]
            return process.returncode, stderr.decode()
        except subprocess.TimeoutExpired:
            process.kill()
            process.communicate()
            return None, ""


def make_inputs(binary, folder):
    folder.mkdir()
    (folder / "small.toml").write_text(SMALL)
    (folder / "model.toml").write_text(MODEL)
    (folder / "lenses.csv").write_text(LENSES)
    points = "".join(f"{i / 100},{1 - i / 80}\n" for i in range(200))
    (folder / "points.csv").write_text("theta_x_arcsec,theta_y_arcsec\n" + points)
    rng = random.Random(0)
    cone = (f"{rng.uniform(9.9, 10.1):.6f},{rng.uniform(-0.1, 0.1):.6f},{rng.uniform(0.05, 1.4):.4f},{10 ** rng.uniform(9, 12):.4e}\n" for _ in range(3000))
    (folder / "cone.csv").write_text("ra_deg,dec_deg,z,m200c_msun\n" + "".join(cone))
    for command in ("populate small.toml -o haloes.csv", "image small.toml -o in"):
        assert run(binary, folder, command)[0] == 0, command
    # A catalogue of one small image.
    (folder / "mine").mkdir()
    shutil.copy(folder / "in" / "image.fits", folder / "mine")
    (folder / "mine" / "truth.csv").write_text("image,gamma1_los,gamma2_los\nimage.fits,0.01,0.02\n")


class Campaign:
    """The undisturbed runs of every command, and kills of them."""

    def __init__(self, binary, base):
        self.binary, self.base, self.tried, self.faults = binary, base, {}, []
        self.common = base / "common"
        make_inputs(binary, self.common)

    def undisturbed(self, name):
        command, other = COMMANDS[name]
        folders = {kind: self.base / f"{name.replace(' ', '-')}-{kind}" for kind in ("whole", "earlier")}
        for folder in folders.values():
            shutil.copytree(self.common, folder)
        start = time.monotonic()
        code, stderr = run(self.binary, folders["whole"], command)
        duration = time.monotonic() - start
        earlier, _ = run(self.binary, folders["earlier"], f"{command} {other}")
        whole, hidden = files(folders["whole"])
        if {code, earlier} - {0, 1} or "panicked" in stderr or hidden or not whole:
            self.faults.append(f"{name}: exit {code} and {earlier}, {len(whole)} files, hidden {hidden}: {stderr.strip()}")
        elif whole == files(folders["earlier"])[0]:
            self.faults.append(f"{name}: {other} changes nothing")
        else:
            self.tried[name] = (command, duration, whole, folders["earlier"])

    def kill(self, k):
        """Name, whether it was still running, what was seen after it, and faults."""
        name = list(self.tried)[k % len(self.tried)]
        command, duration, whole, earlier = self.tried[name]
        rng = random.Random(k)
        folder = self.base / f"kill-{k}"
        shutil.copytree(earlier if k // len(self.tried) % 2 else self.common, folder)
        before = files(folder)[0]
        # Half of the kills fall into the last tenth, where files get their names.
        limit = duration * (rng.uniform(0.9, 1.05) if rng.random() < 0.5 else rng.random())
        code, _ = run(self.binary, folder, command, limit)
        seen, _ = files(folder)
        faults = []
        if seen == whole:
            outcome = "whole"
        elif seen == before:
            outcome = "earlier" if before else "nothing"
        elif before and all(digest in (before.get(n), whole.get(n)) for n, digest in seen.items()):
            outcome = "finished by the next run"
        else:
            outcome = "part"
            faults.append(f"{name}: part of the files: {sorted(seen)}")
        code_after, stderr = run(self.binary, folder, command)
        after, hidden = files(folder)
        if code_after not in (0, 1) or "panicked" in stderr or after != whole or hidden:
            differing = sorted(n for n in after.keys() | whole.keys() if after.get(n) != whole.get(n))
            faults.append(f"{name}: then exit {code_after}, differing {differing}, hidden {hidden}: {stderr.strip()[:300]}")
        shutil.rmtree(folder)
        return name, code is None, outcome, faults


def main():
    binary, number = str(pathlib.Path(sys.argv[1]).resolve()), int(sys.argv[2])
    base = pathlib.Path(tempfile.mkdtemp(prefix="kills-"))
    keys = ("nothing", "earlier", "whole", "finished by the next run")
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        campaign = Campaign(binary, base)
        list(pool.map(campaign.undisturbed, COMMANDS))
        campaign.tried = {name: campaign.tried[name] for name in COMMANDS if name in campaign.tried}
        counts = {name: dict.fromkeys(("kills", *keys, "part"), 0) for name in campaign.tried}
        for done, (name, killed, outcome, faults) in enumerate(pool.map(campaign.kill, range(number)), 1):
            counts[name]["kills"] += killed
            counts[name][outcome] += 1
            campaign.faults += faults
            if done % 50 == 0:
                print(f"{done} of {number}, {len(campaign.faults)} faults", file=sys.stderr)
    shutil.rmtree(base)

    heads = ["command", "killed", "no file seen", "files of the run before", "all files", "finished by the next run"]
    lines = ["| " + " | ".join(heads) + " |", "|---" * len(heads) + "|"]
    lines += [f"| `{name}` | " + " | ".join(str(count[key]) for key in ("kills", *keys)) + " |" for name, count in counts.items()]
    total = sum(count["kills"] for count in counts.values())
    lines.append(
        f"\n{number} runs, {total} of them killed before their end, on {datetime.date.today()} on {os.cpu_count()} cores; "
        f"{len(campaign.faults)} left part of a set of files, litter after the next run, or other bytes at the end."
    )
    text = "\n".join(lines)
    print(text, *campaign.faults, sep="\n")
    if len(sys.argv) > 3:
        page = pathlib.Path(sys.argv[3])
        before, rest = page.read_text().split("<!-- kills -->")
        page.write_text(f"{before}<!-- kills -->\n\n{text}\n\n<!-- /kills -->{rest.split('<!-- /kills -->')[1]}")
    sys.exit(bool(campaign.faults))


if __name__ == "__main__":
    main()
