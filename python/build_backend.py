"""maturin's build backend, with the `haloray` command laid into the wheel beside the package."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
from pathlib import Path
from typing import Any

import maturin
from maturin import get_requires_for_build_sdist, get_requires_for_build_wheel  # noqa: F401

HERE = Path(__file__).resolve().parent
SCRIPTS = HERE / "haloray.data" / "scripts"


def _command() -> Path:
    """Builds the command and says where it is."""
    cargo = os.environ.get("CARGO", "cargo")
    options = ["--release", "--package", "haloray", "--bin", "haloray", "--message-format=json-render-diagnostics"]
    # A source distribution has this file at its root, a clone in python/.
    root = HERE if (HERE / "python").is_dir() else HERE.parent
    built = subprocess.run([cargo, "build", *options], cwd=root, check=True, stdout=subprocess.PIPE)
    messages = (json.loads(line) for line in built.stdout.splitlines())
    return Path(next(own["executable"] for own in messages if own.get("executable")))


def build_wheel(wheel_directory: str, config_settings: Any = None, metadata_directory: Any = None) -> str:
    """A wheel with extension, package and command."""
    SCRIPTS.mkdir(parents=True, exist_ok=True)
    command = Path(shutil.copy2(_command(), SCRIPTS))
    if strip := shutil.which("strip"):
        subprocess.run([strip, str(command)], check=True)
    return maturin.build_wheel(wheel_directory, config_settings, metadata_directory)


def build_sdist(sdist_directory: str, config_settings: Any = None) -> str:
    """The sources of library, command and package; maturin wants the folder of scripts to be there."""
    SCRIPTS.mkdir(parents=True, exist_ok=True)
    return maturin.build_sdist(sdist_directory, config_settings)


def prepare_metadata_for_build_wheel(metadata_directory: str, config_settings: Any = None) -> str:
    """What pip asks for before it builds; maturin wants the folder of scripts to be there."""
    SCRIPTS.mkdir(parents=True, exist_ok=True)
    return maturin.prepare_metadata_for_build_wheel(metadata_directory, config_settings)


def build_editable(wheel_directory: str, config_settings: Any = None, metadata_directory: Any = None) -> str:
    """An editable install, without the command."""
    SCRIPTS.mkdir(parents=True, exist_ok=True)
    return maturin.build_editable(wheel_directory, config_settings, metadata_directory)


get_requires_for_build_editable = get_requires_for_build_wheel
