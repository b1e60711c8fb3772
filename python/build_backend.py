"""maturin's build backend, with the `haloray` command laid into the wheel beside the package.

Settings (`pip install ./python -C hdf5=static`):

hdf5
    `static` builds HDF5 and zlib into the wheel, which then needs neither on the machine it runs on (six minutes, CMake comes
    from PyPI); `system` links to the machine's. Left out, the machine's where there is one.
profile
    Of cargo: `release` if left out; `quick` while writing.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
from pathlib import Path
from typing import Any

import maturin
from maturin import get_requires_for_build_sdist  # noqa: F401

HERE = Path(__file__).resolve().parent
# A source distribution has this file at its root, a clone in python/.
ROOT = HERE if (HERE / "python").is_dir() else HERE.parent
SCRIPTS = HERE / "haloray.data" / "scripts"
NOTICES = HERE / "THIRD_PARTY_LICENSES.txt"


def _setting(settings: Any, name: str, default: str, allowed: tuple[str, ...]) -> str:
    value = (settings or {}).get(name, default)
    if allowed and value not in allowed:
        raise SystemExit(f"the setting {name} is {value!r}, but must be {' or '.join(allowed)}")
    return str(value)


def _has_system_hdf5() -> bool:
    """Whether the crate hdf5-metno-sys would find a library with its headers."""
    usual = ("/usr/include/hdf5.h", "/usr/include/hdf5/serial/hdf5.h")
    if os.environ.get("HDF5_DIR") or any(Path(path).exists() for path in usual):
        return True
    found = shutil.which("pkg-config")
    return found is not None and subprocess.run([found, "--exists", "hdf5"], check=False).returncode == 0


def _is_static(settings: Any) -> bool:
    chosen = "system" if _has_system_hdf5() else "static"
    return _setting(settings, "hdf5", chosen, ("static", "system")) == "static"


def _features(settings: Any) -> list[str]:
    return ["--features", "static-hdf5"] if _is_static(settings) else []


def _options(settings: Any) -> list[str]:
    """What cargo is told, for the command and for the extension alike."""
    return ["--profile", _setting(settings, "profile", "release", ()), *_features(settings)]


def _for_maturin(settings: Any) -> dict[str, Any]:
    given = maturin.get_maturin_pep517_args(settings)
    return {"build-args": [*given, *_options(settings)]}


def _cargo(*arguments: str) -> bytes:
    cargo = os.environ.get("CARGO", "cargo")
    return subprocess.run([cargo, *arguments], cwd=ROOT, check=True, stdout=subprocess.PIPE).stdout


def _command(settings: Any) -> Path:
    """Builds the command and says where it is."""
    what = ["--package", "haloray", "--bin", "haloray", "--message-format=json-render-diagnostics"]
    messages = (json.loads(line) for line in _cargo("build", *_options(settings), *what).splitlines())
    return Path(next(own["executable"] for own in messages if own.get("executable")))


def _write_notices(settings: Any) -> None:
    """The licences of all that is compiled into extension and command, one after the other."""
    shape = ["--edges=normal", "--prefix=none", "--format={p}", *_features(settings)]
    tree = _cargo("tree", "--package", "haloray-python", *shape)
    used = {tuple(line.split()[:2]) for line in tree.decode().splitlines() if line.strip()}
    parts: dict[str, list[str]] = {}
    packages = json.loads(_cargo("metadata", "--format-version=1", *_features(settings)))["packages"]
    for package in sorted(packages, key=lambda own: own["name"]):
        if (package["name"], "v" + package["version"]) not in used or package["name"].startswith("haloray"):
            continue
        folder = Path(package["manifest_path"]).parent
        files = [
            own for own in folder.iterdir() if own.name.upper().startswith(("LICENSE", "LICENCE", "COPYING", "NOTICE"))
        ]
        files += [folder / package["license_file"]] if package["license_file"] else []
        own = f"{package['name']} {package['version']}: {package['license'] or 'see below'}"
        for text in sorted({file.read_text("utf-8", "replace").strip() for file in files if file.is_file()} or {""}):
            parts.setdefault(text, []).append(own)
    blocks = ("\n".join(names) + "\n\n" + text for text, names in parts.items())
    NOTICES.write_text(("\n\n" + "-" * 80 + "\n\n").join(blocks) + "\n", "utf-8")


def get_requires_for_build_wheel(config_settings: Any = None) -> list[str]:
    """HDF5 2.x is built with CMake 3.26 or newer."""
    return [
        *maturin.get_requires_for_build_wheel(config_settings),
        *(["cmake>=3.26"] if _is_static(config_settings) else []),
    ]


def build_wheel(wheel_directory: str, config_settings: Any = None, metadata_directory: Any = None) -> str:
    """A wheel with extension, package and command."""
    SCRIPTS.mkdir(parents=True, exist_ok=True)
    command = Path(shutil.copy2(_command(config_settings), SCRIPTS))
    if strip := shutil.which("strip"):
        subprocess.run([strip, str(command)], check=True)
    _write_notices(config_settings)
    return maturin.build_wheel(wheel_directory, _for_maturin(config_settings), metadata_directory)


def build_sdist(sdist_directory: str, config_settings: Any = None) -> str:
    """The sources of library, command and package; maturin wants folder of scripts and notices to be there."""
    SCRIPTS.mkdir(parents=True, exist_ok=True)
    _write_notices(config_settings)
    return maturin.build_sdist(sdist_directory, None)


def prepare_metadata_for_build_wheel(metadata_directory: str, config_settings: Any = None) -> str:
    """What pip asks for before it builds; maturin wants folder of scripts and notices to be there."""
    SCRIPTS.mkdir(parents=True, exist_ok=True)
    _write_notices(config_settings)
    return maturin.prepare_metadata_for_build_wheel(metadata_directory, _for_maturin(config_settings))


def build_editable(wheel_directory: str, config_settings: Any = None, metadata_directory: Any = None) -> str:
    """An editable install, without the command."""
    SCRIPTS.mkdir(parents=True, exist_ok=True)
    return maturin.build_editable(wheel_directory, _for_maturin(config_settings), metadata_directory)


get_requires_for_build_editable = get_requires_for_build_wheel
