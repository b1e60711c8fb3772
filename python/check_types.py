"""Types of the package, of the examples and of the code that pages and notebooks show, by mypy --strict and pyright in strict mode.

python3 check_types.py FOLDER [--only mypy|pyright]

Runs with an interpreter that has mypy, pyright, numpy, matplotlib and xarray; the compiled half need not be built. The blocks of a page are one
module in FOLDER/pages. Packages without types, which the code shown imports, are Any there: FOLDER/typings says so.
"""

from __future__ import annotations

import argparse
import ast
import json
import os
import re
import subprocess
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent
#: Where code is shown.
PAGES = ("README.md", "python/README.md", "docs/*.md", "docs/*/*.md")
BLOCK = re.compile(r"^```(?:python|\{code-cell\} ipython3)\n(.*?)^```", re.DOTALL | re.MULTILINE)
#: Packages that come without types, or with half of them.
UNTYPED = {
    *(
        "arviz",
        "astropy",
        "coolest",
        "corner",
        "dask",
        "emcee",
        "h5py",
        "lenstronomy",
        "matplotlib",
        "mpi4py",
        "pandas",
        "pyHalo",
        "scipy",
    ),
    *("slsim", "xarray"),
}
ANYTHING = "from typing import Any\n\ndef __getattr__(name: str) -> Any: ...\n"


def shown(folder: Path) -> list[Path]:
    """A module for each page that shows code."""
    folder.mkdir(parents=True, exist_ok=True)
    found: list[Path] = []
    for pattern in PAGES:
        for page in sorted(ROOT.glob(pattern)):
            blocks: list[str] = BLOCK.findall(page.read_text(encoding="utf-8"))
            if blocks:
                name = "_".join(page.relative_to(ROOT).with_suffix("").parts)
                found.append(folder / f"{name}.py")
                found[-1].write_text("\n".join(blocks), encoding="utf-8")
    return found


def write_stubs(modules: list[Path], folder: Path) -> None:
    """Stubs in which everything is Any, for what the modules import of packages without types."""
    names: set[str] = set()
    for module in modules:
        for node in ast.walk(ast.parse(module.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Import):
                names |= {own.name for own in node.names}
            elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
                names.add(node.module)
    for name in sorted(names):
        parts = name.split(".")
        if parts[0] in UNTYPED:
            for depth in range(1, len(parts) + 1):
                place = folder.joinpath(*parts[:depth])
                place.mkdir(parents=True, exist_ok=True)
                (place / "__init__.pyi").write_text(ANYTHING, encoding="utf-8")


def mypy(paths: list[Path], typings: Path) -> int:
    # Modules one at a time: examples are called the same in different folders.
    environment = {**os.environ, "MYPYPATH": f"{HERE}{os.pathsep}{typings}"}
    command = [sys.executable, "-m", "mypy", "--strict", "--config-file", str(HERE / "pyproject.toml")]
    command += ["--scripts-are-modules", "--cache-dir", str(typings.parent / "mypy")]
    groups: list[list[Path]] = []
    for path in paths:
        free = next((group for group in groups if all(own.name != path.name for own in group)), None)
        if free is None:
            groups.append([path])
        else:
            free.append(path)
    return max(
        subprocess.run([*command, *map(str, group)], env=environment, check=False).returncode for group in groups
    )


def pyright(modules: list[Path], folder: Path) -> int:
    """The package by its own settings, then what is shown."""
    settings = {
        "include": [os.path.relpath(path, folder) for path in modules],
        "extraPaths": [os.path.relpath(HERE, folder)],
        "stubPath": "typings",
        "typeCheckingMode": "strict",
        "pythonVersion": "3.11",
        "reportMissingTypeStubs": "none",
        "reportPrivateUsage": "none",
        # The stubs stand for packages that need not be installed.
        "reportMissingModuleSource": "none",
        # A page may show a value by its name alone.
        "reportUnusedExpression": "none",
    }
    file = folder / "pyrightconfig.json"
    file.write_text(json.dumps(settings, indent=1), encoding="utf-8")
    command = [sys.executable, "-m", "pyright", "--pythonpath", sys.executable, "-p"]
    return max(subprocess.run([*command, str(place)], check=False).returncode for place in (HERE, file))


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("folder", type=Path)
    parser.add_argument("--only", choices=["mypy", "pyright"])
    asked = parser.parse_args()
    folder: Path = asked.folder.resolve()
    modules = [*shown(folder / "pages"), *sorted((ROOT / "examples").rglob("*.py"))]
    write_stubs(modules, folder / "typings")
    failed = [
        name
        for name, check in (
            ("mypy", lambda: mypy([HERE / "haloray", *modules], folder / "typings")),
            ("pyright", lambda: pyright(modules, folder)),
        )
        if asked.only in (None, name) and check() != 0
    ]
    print(f"{len(modules)} modules of pages and examples, and the package: {', '.join(failed) or 'no'} complaint")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
