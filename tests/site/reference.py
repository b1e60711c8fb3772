"""Writes the pages of reference that the binary knows best: docs/reference/{command_line,configuration,models}.md.

python3 tests/site/reference.py target/release/haloray [--check]

With --check nothing is written, and pages that are not what the binary says end it with 1. Needs nothing but Python 3.11.
"""

import json
import pathlib
import re
import subprocess
import sys
import tempfile
import tomllib

FOLDER = pathlib.Path(__file__).resolve().parents[2] / "docs" / "reference"
# Options that every command has: shown once.
COMMON = re.compile(r"\n      --threads <N>\n.*?(?=\n  -h, --help)", re.DOTALL)


class Binary:
    """The command, called by its name, so that its texts name it so."""

    def __init__(self, path, scratch):
        self.link = pathlib.Path(scratch) / "haloray"
        self.link.symlink_to(pathlib.Path(path).resolve())

    def __call__(self, *arguments):
        return subprocess.run([self.link, *arguments], check=True, capture_output=True, text=True).stdout

    def commands(self, *of):
        """Names of subcommands, without `help`."""
        listed = re.search(r"\nCommands:\n(.*?)\n\n", self(*of, "--help"), re.DOTALL)[1]
        return [name for name in re.findall(r"^  (\S+)", listed, re.MULTILINE) if name != "help"]


def fenced(text, language="text"):
    return f"```{language}\n{text.strip()}\n```\n"


def command_line(binary):
    page = ["# Command line", "What `haloray COMMAND --help` prints.", "## haloray", fenced(binary("--help"))]
    for name in binary.commands():
        page += [f"## haloray {name}", fenced(COMMON.sub("", binary(name, "--help")))]
        if name == "study":
            for study in binary.commands(name):
                page += [f"### haloray study {study}", fenced(COMMON.sub("", binary(name, study, "--help")))]
    return "\n\n".join(page)


def configuration(binary):
    schema, presets = json.loads(binary("schema")), {}
    for name in ("paper", "consistent"):
        presets[name] = tomllib.loads(binary("schema", "--preset", name))

    def named(node):
        for place in (node, *node.get("anyOf", ())):
            if "$ref" in place:
                return schema["$defs"][place["$ref"].rsplit("/", 1)[1]]
        return {}

    def sentence(text):
        return re.sub(r"\s+", " ", text.split("\n\n")[0]).replace("|", "\\|").replace("<", "&lt;")

    def value(preset, *keys):
        found = presets[preset]
        for key in keys:
            found = found.get(key) if isinstance(found, dict) else None
        if found is None:
            return "—"
        if isinstance(found, dict):
            return "`{ " + ", ".join(f"{key} = {own}" for key, own in found.items()) + " }`"
        return f"`{found:.10g}`" if type(found) is float else f"`{json.dumps(found, ensure_ascii=False)}`"

    def rows(properties, *table):
        yield "| key | `paper` | `consistent` | what |\n|---|---|---|---|"
        for key, node in properties.items():
            words = [own["const"] for own in named(node).get("oneOf", ()) if "const" in own]
            choice = " Of: " + ", ".join(f"`{word}`" for word in words) + "." if len(words) > 1 else ""
            values = (value(preset, *table, key) for preset in presets)
            yield f"| `{key}` | {' | '.join(values)} | {sentence(node.get('description', ''))}{choice} |"

    tables = {key: named(node) for key, node in schema["properties"].items() if named(node).get("properties")}
    plain = {key: node for key, node in schema["properties"].items() if key not in tables}
    page = [
        "# Configuration",
        "A configuration is a TOML file laid over a preset: it holds only the keys that it changes. "
        "`--set haloes.min_point_shear=1e-5` sets one on the command line; in Python it is a dictionary of dictionaries. "
        "`haloray schema KEY` explains a key in the terminal, `haloray schema --preset paper` prints a complete file, `haloray schema` the JSON schema that editors use. "
        "— stands where a preset leaves a key out. A key's unit is the end of its name; none is a pure number.",
        "\n".join(rows(plain)),
    ]
    for key, table in tables.items():
        page += [f"## [{key}]", sentence(schema["properties"][key].get("description", table.get("description", "")))]
        page += ["\n".join(rows(table["properties"], key))]
        for inner, node in table["properties"].items():
            if named(node).get("properties"):
                page += [f"### [{key}.{inner}]", sentence(named(node).get("description", ""))]
                page += ["\n".join(rows(named(node)["properties"], key, inner))]
    return "\n\n".join(page)


def models(binary):
    return "\n\n".join(
        [
            "# Models of fits",
            "What `haloray fit --list` prints. `haloray fit --list --model NAME > my.toml` is the start of a model of your own; "
            "[the file](../FILES.md) and [how to fit an image](../FIT.md) say more.",
            fenced(binary("fit", "--list")),
            "Two of them in full:",
            *(fenced(binary("fit", "--list", "--model", name), "toml") for name in ("tidal-minimal", "comprehensive")),
        ]
    )


def main():
    check = "--check" in sys.argv
    stale = []
    with tempfile.TemporaryDirectory() as scratch:
        binary = Binary(sys.argv[1], scratch)
        for page in (command_line, configuration, models):
            path, text = FOLDER / f"{page.__name__}.md", page(binary).rstrip() + "\n"
            if check and (not path.exists() or path.read_text(encoding="utf-8") != text):
                stale.append(str(path))
            elif not check:
                path.write_text(text, encoding="utf-8")
    for path in stale:
        print(f"{path} is not what the binary says: just site-reference")
    sys.exit(1 if stale else 0)


if __name__ == "__main__":
    main()
