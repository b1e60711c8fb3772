"""Runs every code block of the pages that teach, in order, in an empty folder a page, and compares what they print.

python3 tests/site/check.py --binary target/release/haloray [--python .venv/bin/python] [--long] [PAGE …]

`sh` and `python` blocks run; the Python blocks of a page share their names. A `text` block is what the block before it prints: `…` stands
for anything, alone on a line for any lines. A comment right above a block changes that:

    <!-- check: file examples/a/b.toml -->  the block is that file, to the letter, and lies in the folder for what follows
    <!-- check: run examples/a/b.py -->     the same, and it runs
    <!-- check: exit 2 -->                  it ends with that code, and a `text` block is what it says on stderr
    <!-- check: about -->                   numbers of a `text` block may differ by 5% (fits repeat theirs on one kind of processor)
    <!-- check: long -->                    runs with --long alone
    <!-- check: skip REASON -->             does not run; reasons are counted

Relative links of all pages must lead to files. Fails with page and line. Needs nothing but Python.
"""

import argparse
import collections
import json
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
TAUGHT = ("docs/start.md", "docs/tutorials/*.md", "docs/howto/*.md", "docs/concepts/*.md", "docs/gallery.md")
BLOCK_LIMIT_S = 900
NUMBER = re.compile(r"[-−+]?\d[\d,]*\.?\d*(?:[eE][-+]?\d+|×10[⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+)?")
SUPERSCRIPTS = str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹−", "-0123456789-", ",")
# Runs blocks that come as JSON lines on stdin, and answers on a channel of its own what each printed or raised.
WORKER = """
import contextlib, io, json, sys, traceback
names, answers = {"__name__": "__main__"}, sys.stdout
for line in sys.stdin:
    page, number, source = json.loads(line)
    printed, failure = io.StringIO(), None
    try:
        with contextlib.redirect_stdout(printed):
            exec(compile("\\n" * number + source, page, "exec"), names)
    except BaseException:
        failure = traceback.format_exc()
    print(json.dumps([printed.getvalue(), failure]), file=answers, flush=True)
"""

Block = collections.namedtuple("Block", "language line source mark")


class Failure(Exception):
    """What a block did that the page does not say."""


def blocks(text):
    """The fenced blocks of a page, with the line of their first line of code and the mark above each."""
    found, mark, lines = [], "", text.split("\n")
    number = 0
    while number < len(lines):
        line = lines[number]
        if comment := re.fullmatch(r"<!-- check: (.*?) -->", line.strip()):
            mark = comment[1]
        elif fence := re.fullmatch(r"(`{3,})\s*([\w-]*)", line):
            end = lines.index(fence[1], number + 1)
            found.append(Block(fence[2], number + 2, "".join(f"{own}\n" for own in lines[number + 1 : end]), mark))
            number, mark = end, ""
        elif line.strip():
            mark = ""
        number += 1
    return found


def dead_links():
    """Relative links, of pages and READMEs, to files that do not exist (the site's build checks headings too)."""
    for path in [path for name in ("*.md", "python/*.md", "examples/*.md", "docs/**/*.md") for path in ROOT.glob(name)]:
        text = path.read_text(encoding="utf-8")
        text = re.sub(r"^```.*?^```", lambda block: "\n" * block[0].count("\n"), text, flags=re.DOTALL | re.MULTILINE)
        for link in re.finditer(r"\]\(([^)#:\s]+)(?:#[^)]*)?\)", text):
            if not (path.parent / link[1]).exists():
                yield f"{path.relative_to(ROOT)}:{text.count(chr(10), 0, link.start()) + 1}: no such file {link[1]}"


def agrees(expected, printed, about):
    """Whether what was printed is what the page shows."""
    pattern, numbers = "", []
    for line in expected.rstrip("\n").split("\n"):
        if line.strip() == "…":
            pattern += r"(?:.*\n)*?"
            continue
        rest = 0
        for piece in re.finditer(f"…|{NUMBER.pattern}" if about else "…", line.rstrip()):
            pattern += re.escape(line[rest : piece.start()])
            if piece[0] == "…":
                pattern += ".*?"
            else:
                numbers.append(piece[0])
                pattern += f"({NUMBER.pattern})"
            rest = piece.end()
        pattern += re.escape(line[rest:].rstrip()) + r"[ \t]*\n"
    if about:
        pattern = re.sub(r"(?:\\ )+", r"\\s+", pattern)
    found = re.fullmatch(pattern, printed.rstrip("\n") + "\n")
    return found is not None and all(close(*pair) for pair in zip(numbers, found.groups()))


def close(left, right):
    """Whether two printed numbers are the same within 5%, or both within 0.005 of each other."""
    left, right = (float(number.translate(SUPERSCRIPTS).replace("×10", "e")) for number in (left, right))
    return abs(left - right) <= max(0.05 * abs(left), 0.005)


class Page:
    """One page: its folder, its Python interpreter, and what the block before printed."""

    def __init__(self, path, options, folder):
        self.name, self.options, self.folder = str(path.relative_to(ROOT)), options, folder
        self.worker, self.printed, self.about = None, None, False
        self.counts = collections.Counter()
        commands = folder.parent / "commands"
        os.environ["PATH"] = os.pathsep.join([str(commands), options.python_folder, options.path])
        self.text = path.read_text(encoding="utf-8")

    def run(self):
        try:
            for block in blocks(self.text):
                try:
                    self.one(block)
                except Failure as failure:
                    yield f"{self.name}:{block.line}: {failure}"
                    if block.language != "text":
                        return
        finally:
            if self.worker:
                self.worker.stdin.close()
                self.worker.wait()

    def one(self, block):
        action, _, rest = block.mark.partition(" ")
        if action in ("file", "run"):
            file = ROOT / rest
            if not file.exists() or file.read_text(encoding="utf-8") != block.source:
                raise Failure(f"the block is not {rest}, to the letter")
            (self.folder / file.name).write_text(block.source, encoding="utf-8")
            self.counts["file"] += 1
            if action == "file":
                return
        if block.language == "text":
            if self.printed is None:
                return
            self.counts["output"] += 1
            if not agrees(block.source, self.printed, self.about or action == "about"):
                raise Failure(f"the page shows what was not printed; it was\n{self.printed}")
        elif block.language in ("sh", "python"):
            self.printed, self.about = None, action == "about"
            if action == "skip" or (action == "long" and not self.options.long):
                self.counts[f"not run: {rest or action}"] += 1
            elif block.language == "sh":
                self.printed = self.shell(block, int(rest) if action == "exit" else 0)
                self.counts["sh"] += 1
            elif not self.options.python:
                self.counts["not run: no --python"] += 1
            else:
                self.printed = self.python(block)
                self.counts["python"] += 1

    def shell(self, block, code):
        shell = ["bash", "-euo", "pipefail", "-c", block.source]
        try:
            done = subprocess.run(shell, cwd=self.folder, capture_output=True, text=True, timeout=BLOCK_LIMIT_S)
        except subprocess.TimeoutExpired:
            raise Failure(f"it runs for over {BLOCK_LIMIT_S} s") from None
        if done.returncode != code:
            raise Failure(f"exit code {done.returncode}, not {code}\n{done.stderr[-2000:]}")
        return done.stderr if code else done.stdout

    def python(self, block):
        if not self.worker:
            command = [self.options.python, "-c", WORKER]
            pipes = dict(stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
            self.worker = subprocess.Popen(command, cwd=self.folder, text=True, **pipes)
        print(json.dumps([self.name, block.line - 1, block.source]), file=self.worker.stdin, flush=True)
        answer = self.worker.stdout.readline()
        printed, failure = json.loads(answer) if answer else ("", "the interpreter ended")
        if failure:
            raise Failure(failure)
        return printed


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--binary", required=True, type=pathlib.Path)
    parser.add_argument("--python", help="an interpreter with haloray, astropy, h5py, matplotlib and xarray")
    parser.add_argument("--long", action="store_true", help="also what is marked long")
    parser.add_argument("pages", nargs="*", type=pathlib.Path)
    options = parser.parse_args()
    options.path = os.environ["PATH"]
    options.python_folder = str(pathlib.Path(options.python).absolute().parent) if options.python else "/nonexistent"
    if options.python:
        options.python = str(pathlib.Path(options.python).absolute())
    os.environ["MPLBACKEND"] = "Agg"
    pages = [page.resolve() for page in options.pages] or sorted(page for name in TAUGHT for page in ROOT.glob(name))
    total, failures = collections.Counter(), list(dead_links())
    print(*failures, sep="\n", end="\n" if failures else "")
    for path in pages:
        with tempfile.TemporaryDirectory() as scratch:
            commands, folder = pathlib.Path(scratch, "commands"), pathlib.Path(scratch, "page")
            commands.mkdir(), folder.mkdir()
            (commands / "haloray").symlink_to(options.binary.resolve())
            page, begun = Page(path, options, folder), time.monotonic()
            found = list(page.run())
        counts = ", ".join(f"{number} {what}" for what, number in page.counts.items()) or "nothing to run"
        print(f"{'FAILED' if found else 'ok':6} {time.monotonic() - begun:6.1f} s  {page.name}: {counts}", flush=True)
        for failure in found:
            print(failure, flush=True)
        failures += found
        total += page.counts
    print(f"{len(pages)} pages, " + ", ".join(f"{number} {what}" for what, number in total.items()))
    sys.exit(1 if failures else 0)


if __name__ == "__main__":
    main()
