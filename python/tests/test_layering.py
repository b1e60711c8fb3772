"""The modules of the package import in one direction: each only those that stand above it here, inside functions too."""

import ast
from pathlib import Path

import haloray

PACKAGE = Path(haloray.__file__).parent
#: From what knows nothing to what knows all. Names of folders stand for their ``__init__.py``.
ORDER = [
    "_haloray",
    "_errors",
    "_packages",
    "_units",
    "_cosmology",
    "_progress",
    "_threads",
    "_config",
    "_versions",
    "_drawing",
    "_drawing.style",
    "_drawing.density",
    "_drawing.labels",
    "_drawing.corner",
    "_lens_results",
    "_lens_arguments",
    "_lens_model",
    "_haloes",
    "_coolest",
    "_pyhalo",
    "_decoupled",
    "_effective",
    "_sight",
    "_run",
    "_ensemble",
    "_observation",
    "_fit",
    "_log_posterior",
    "_mock",
    "_read",
    "_slsim",
    "figures._saved",
    "figures._lens",
    "figures._maps",
    "figures._images",
    "figures._run",
    "figures._fit",
    "figures._ensemble",
    "figures._studies",
    "figures._expected",
    "figures._validity",
    "figures",
    "",
]


def name_of(path: Path) -> str:
    parts = path.relative_to(PACKAGE).with_suffix("").parts
    return ".".join(part for part in parts if part != "__init__")


MODULES = {name_of(path): path for path in PACKAGE.rglob("*.py")}


def imported(name: str) -> set[str]:
    """Modules of the package that a module imports, wherever in its text, for types alone or not."""
    package = (
        name.split(".")[:-1] if MODULES[name].name != "__init__.py" else [part for part in name.split(".") if part]
    )
    found = set()
    for node in ast.walk(ast.parse(MODULES[name].read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found |= {own.name for own in node.names if own.name.partition(".")[0] == "haloray"}
        elif isinstance(node, ast.ImportFrom) and (node.level or (node.module or "").partition(".")[0] == "haloray"):
            if node.level:
                base = package[: len(package) - (node.level - 1)] + (node.module or "").split(".")
            else:
                base = (node.module or "").split(".")[1:]
            parent = ".".join(part for part in base if part)
            for own in node.names:
                child = f"{parent}.{own.name}".lstrip(".")
                found.add(child if child in MODULES or child == "_haloray" else parent)
    return found


def test_every_module_has_its_place():
    assert set(ORDER) - {"_haloray"} == set(MODULES)
    assert len(ORDER) == len(set(ORDER))


def test_modules_import_only_those_above_them():
    against = [
        f"{name or 'haloray'} imports {own or 'haloray'}"
        for place, name in enumerate(ORDER)
        if name in MODULES
        for own in imported(name)
        if own not in ORDER[:place]
    ]
    assert not against, against


def test_local_and_relative_imports_are_seen(tmp_path, monkeypatch):
    path = tmp_path / "_x.py"
    path.write_text(
        "def f():\n    from .figures._saved import run_of\n    from . import _fit\n    import haloray.figures\n"
        "from ._errors import Error\nfrom haloray import _run\nimport numpy\nfrom numpy import array\n"
    )
    monkeypatch.setitem(MODULES, "_x", path)
    assert imported("_x") == {"figures._saved", "_fit", "haloray.figures", "_errors", "_run"}
