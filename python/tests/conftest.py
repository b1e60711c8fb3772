"""What several tests use: the command, and haloes of a small cone."""

import os
import shutil
import subprocess
from pathlib import Path

import pytest

import haloray as hr

#: A cone of some hundred haloes.
SMALL = {"haloes": {"min_point_shear": 3e-5}}


@pytest.fixture(scope="session")
def command(tmp_path_factory):
    """Runs the `haloray` command in a folder of its own."""
    found = os.environ.get("HALORAY_COMMAND") or shutil.which("haloray")
    if found is None:
        pytest.skip("the command haloray is not installed")
    folder = tmp_path_factory.mktemp("command")
    (folder / "small.toml").write_text("[haloes]\nmin_point_shear = 3e-5\n")

    def run(*arguments: str) -> Path:
        subprocess.run([found, "--quiet", *arguments], cwd=folder, check=True)
        return folder

    return run


@pytest.fixture(scope="session")
def haloes():
    return hr.populate(SMALL, seed=3)


@pytest.fixture(scope="session")
def sight(haloes):
    return hr.LineOfSight(haloes)
