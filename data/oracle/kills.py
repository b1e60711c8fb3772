#!/usr/bin/env python3
"""Kills haloray at random moments and looks at what is left: `kills.py BINARY N [PAGE]`.

Every command runs once undisturbed for its bytes and its duration, and once with other settings, whose files stand for an earlier run.
Then until N were killed: the command is started in a folder of its own, or over the files of the earlier run, killed with SIGKILL at a random
moment (seeded) of its duration, and the files are looked at: none, those of the earlier run, or the whole run's. The same command is then
run to its end: its bytes must be those of the undisturbed run, and nothing may be left beside them. As many kills at a time as there are
cores. With PAGE the counts replace the section between `<!-- kills -->` and `<!-- /kills -->`.
"""

import concurrent.futures
import datetime
import os
import pathlib
import random
import shutil
import sys
import tempfile
import time

from every_command import COMMANDS, files, make_inputs, replace_section, run


def results(seen):
    """Without the fits that have ended, which `study catalogue` keeps where they can be seen until all have."""
    return {name: digest for name, digest in seen.items() if not name.startswith("out/fits/")}


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
        if results(seen) == results(whole):
            outcome = "whole"
        elif results(seen) == results(before):
            outcome = "earlier" if before else "nothing"
        elif before and all(digest in (before.get(n), whole.get(n)) for n, digest in results(seen).items()):
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
        total = runs = 0
        while total < number and campaign.tried:
            for name, killed, outcome, faults in pool.map(campaign.kill, range(runs, runs + 20)):
                counts[name]["kills"] += killed
                counts[name][outcome] += 1
                campaign.faults += faults
                print(*faults, sep="", end="\n" * len(faults), file=sys.stderr)
                total += killed
            runs += 20
            print(f"{total} of {number}, {len(campaign.faults)} faults", file=sys.stderr)
    shutil.rmtree(base)

    heads = ["command", "killed", "no file seen", "files of the run before", "all files", "finished by the next run"]
    lines = ["| " + " | ".join(heads) + " |", "|---" * len(heads) + "|"]
    lines += [f"| `{name}` | " + " | ".join(str(count[key]) for key in ("kills", *keys)) + " |" for name, count in counts.items()]
    lines.append(
        f"\n{runs} runs, {total} of them killed before their end, on {datetime.date.today()} on {os.cpu_count()} cores; "
        f"{len(campaign.faults)} left part of a set of files, litter after the next run, or other bytes at the end."
    )
    text = "\n".join(lines)
    print(text, *campaign.faults, sep="\n")
    if len(sys.argv) > 3:
        replace_section(sys.argv[3], "kills", text)
    sys.exit(bool(campaign.faults))


if __name__ == "__main__":
    main()
