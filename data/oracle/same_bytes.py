#!/usr/bin/env python3
"""Every command on 1, 2 and 7 threads and with FMA and AVX2 hidden from the C library: `same_bytes.py BINARY [PAGE]`.

Where qemu's user emulation (Debian's `qemu-user`) is installed, commands without fits also run on an emulated processor of 2008, which
has neither; a fit takes 150 times as long there, and its matrix products and Fourier transforms follow the processor.

All files but `timings.json` must have the same bytes; so must what `distances` prints. With PAGE the table replaces the section between
`<!-- bytes -->` and `<!-- /bytes -->`.
"""

import datetime
import os
import pathlib
import platform
import shutil
import subprocess
import sys
import tempfile

from every_command import COMMANDS, FITS, files, make_inputs, replace_section, run

MASKED = "glibc.cpu.hwcaps=-FMA,-FMA4,-AVX2,-AVX512F,-FMA_Usable,-AVX2_Usable"
QEMU = shutil.which("qemu-x86_64")
# Threads, tunables of the C library, emulator.
WAYS = {
    "1 thread": (1, None, ()),
    "2 threads": (2, None, ()),
    "7 threads": (7, None, ()),
    "FMA and AVX2 masked": (1, MASKED, ()),
} | ({"Nehalem, emulated": (2, None, (QEMU, "-cpu", "Nehalem"))} if QEMU else {})


def main():
    binary = str(pathlib.Path(sys.argv[1]).resolve())
    base = pathlib.Path(tempfile.mkdtemp(prefix="bytes-"))
    make_inputs(binary, base / "common")
    lines = ["| command | files | " + " | ".join(list(WAYS)[1:]) + " |", "|---" * (len(WAYS) + 1) + "|"]
    differing = []
    for name, (command, _) in COMMANDS.items():
        found = {}
        for way, (threads, tunables, emulator) in WAYS.items():
            if emulator and name in FITS:
                continue
            folder = base / "run"
            shutil.copytree(base / "common", folder)
            environment = os.environ | ({"GLIBC_TUNABLES": tunables} if tunables else {})
            code, stderr = run(binary, folder, command, threads=threads, environment=environment, emulator=emulator)
            assert code in (0, 1), (name, code, stderr)
            found[way] = files(folder)[0]
            shutil.rmtree(folder)
        alone = found.pop("1 thread")
        cells = []
        for way in list(WAYS)[1:]:
            if way not in found:
                cells.append("–")
                continue
            there = found[way]
            others = sorted(n for n in alone.keys() | there.keys() if alone.get(n) != there.get(n))
            cells.append("same" if not others else f"{len(others)} differ")
            differing += [f"{name}, {way}: {n}" for n in others]
        lines.append(f"| `{name}` | {len(alone)} | " + " | ".join(cells) + " |")
        print(lines[-1], file=sys.stderr)
    shutil.rmtree(base)

    printed = {
        subprocess.run([binary, "distances", "0.5", "0.8", "--z-source", "1.5"], env=environment, capture_output=True, check=True).stdout
        for environment in (os.environ, os.environ | {"GLIBC_TUNABLES": MASKED})
    }
    differing += ["what distances prints"] * (len(printed) - 1)
    lines.append(f"\n{len(differing)} files differ from those of one thread. {datetime.date.today()}, {processor()}.")
    text = "\n".join(lines)
    print(text, *differing, sep="\n")
    if len(sys.argv) > 2:
        replace_section(sys.argv[2], "bytes", text)
    sys.exit(bool(differing))


def processor():
    for line in pathlib.Path("/proc/cpuinfo").read_text().splitlines():
        if line.startswith("model name"):
            return line.split(":")[1].strip()
    return platform.machine()


if __name__ == "__main__":
    main()
