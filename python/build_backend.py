"""maturin's build backend, with the `haloray` command laid into the wheel beside the package."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
from pathlib import Path
from typing import Any

import maturin
from maturin import build_sdist, get_requires_for_build_sdist, get_requires_for_build_wheel  # noqa: F401

HERE = Path(__file__).resolve().parent
SCRIPTS = HERE / "haloray.data" / "scripts"


def _features(config_settings: dict[str, Any] | None) -> list[str]:
    """Cargo features of the package, given as `pip install -C features=static-hdf5`."""
    return str((config_settings or {}).get("features", "")).split()


def _command(features: list[str]) -> Path:
    """Builds the command and says where it is."""
    cargo = os.environ.get("CARGO", "cargo")
    built = subprocess.run(
        [cargo, "build", "--release", "--package", "haloray", "--bin", "haloray", "--message-format=json-render-diagnostics"]
        + (["--features", "hdf5/static"] if "static-hdf5" in features else []),
        cwd=HERE.parent,
        check=True,
        stdout=subprocess.PIPE,
    )
    messages = (json.loads(line) for line in built.stdout.splitlines())
    return Path(next(own["executable"] for own in messages if own.get("executable")))


def build_wheel(wheel_directory: str, config_settings: Any = None, metadata_directory: Any = None) -> str:
    """A wheel with extension, package and command."""
    features = _features(config_settings)
    SCRIPTS.mkdir(parents=True, exist_ok=True)
    command = Path(shutil.copy2(_command(features), SCRIPTS))
    if strip := shutil.which("strip"):
        subprocess.run([strip, str(command)], check=True)
    if features:
        config_settings = {"build-args": f"--features {','.join(features)}"}
    else:
        config_settings = None
    return maturin.build_wheel(wheel_directory, config_settings, metadata_directory)


def prepare_metadata_for_build_wheel(metadata_directory: str, config_settings: Any = None) -> str:
    """What pip asks for before it builds; maturin wants the folder of scripts to be there."""
    SCRIPTS.mkdir(parents=True, exist_ok=True)
    return maturin.prepare_metadata_for_build_wheel(metadata_directory, None)


def build_editable(wheel_directory: str, config_settings: Any = None, metadata_directory: Any = None) -> str:
    """An editable install, without the command."""
    SCRIPTS.mkdir(parents=True, exist_ok=True)
    return maturin.build_editable(wheel_directory, None, metadata_directory)


get_requires_for_build_editable = get_requires_for_build_wheel
