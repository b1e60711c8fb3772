"""Pages of results in docs/: a script writes command, result and last run; question and meaning stay as they are.

Run:   some-command | python3 page.py ../../docs/PAGE.md "the command that repeats it"
       python3 page.py ../../docs/PAGE.md "the command that repeats it" FOLDER/result.md
Needs: nothing but Python
Units: none
"""

import datetime
import importlib.metadata
import os
import pathlib
import platform
import re
import shutil
import sys


def processor():
    """The name of the processor and the number of cores."""
    info = pathlib.Path("/proc/cpuinfo")
    names = re.findall(r"model name\s*:\s*(.*)", info.read_text()) if info.exists() else []
    return f"{os.cpu_count()} cores, {names[0] if names else platform.machine()}"


def with_section(text, name, body):
    """The text with what stands below that heading replaced, or added at the end."""
    section = f"## {name}\n\n{body.strip(chr(10))}\n"
    found = re.compile(rf"^## {re.escape(name)}\n.*?(?=^## |\Z)", re.MULTILINE | re.DOTALL)
    if found.search(text):
        return found.sub(lambda _: section + "\n", text, count=1).rstrip() + "\n"
    return text.rstrip() + f"\n\n{section}"


def with_true_minus(text):
    """The text with a true minus before the numbers of its tables, and none before what is rounded to nothing."""
    number = re.compile(r"(?<=[| \[(±,])-(\d[\d.]*)")
    sign = lambda found: ("−" if found[1].strip("0.") else "") + found[1]
    return re.sub(r"^ *\|.*$", lambda row: number.sub(sign, row[0]), text, flags=re.MULTILINE)


def write(page, command, result, packages=()):
    """Writes the sections that a command makes into the page at that path."""
    page = pathlib.Path(page)
    headings = ("Question", "Command", "Result", "What it means", "Last run")
    text = page.read_text(encoding="utf-8") if page.exists() else f"# {page.stem}\n\n" + "\n".join(
        f"## {name}\n" for name in headings)
    versions = "".join(f", {name} {importlib.metadata.version(name)}" for name in packages)
    last = f"{datetime.date.today().isoformat()}, {processor()}{versions}."
    for name, body in (("Command", f"    {command}"), ("Result", with_true_minus(result)), ("Last run", last)):
        text = with_section(text, name, body)
    page.write_text(text, encoding="utf-8")


def with_figures(result, folder, page):
    """The result with its figures copied to figures/ beside the page, under names that say which page they belong to."""
    subject = page.stem.lower().split("_")[0]
    (page.parent / "figures").mkdir(exist_ok=True)

    def copied(link):
        name = link[2] if link[2].startswith(subject) else f"{subject}_{link[2]}"
        shutil.copyfile(folder / link[2], page.parent / "figures" / name)
        return f"![{link[1]}](figures/{name})"

    return re.sub(r"!\[(.*?)\]\((\S+\.png)\)", copied, result)


if __name__ == "__main__":
    target, made_by = pathlib.Path(sys.argv[1]), sys.argv[2]
    if len(sys.argv) > 3:
        source = pathlib.Path(sys.argv[3])
        write(target, made_by, with_figures(source.read_text(encoding="utf-8"), source.parent, target))
    else:
        output = sys.stdin.read()
        print(output, end="")
        write(target, made_by, output)
