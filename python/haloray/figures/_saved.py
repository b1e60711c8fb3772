"""What is drawn: results in memory, or the folders and files that hold them."""

from __future__ import annotations

import csv
import json
import os
from typing import Any, Union, cast

import numpy as np

from .._errors import InputError
from .._read import Run, folder_file, read
from .._run import Simulation
from .._units import Array

#: A run: its folder, its file, or :func:`haloray.read` of it.
RunLike = Union[Run, str, "os.PathLike[str]"]


def run_of(run: Any) -> Run:
    """A run, read where it is a path."""
    if isinstance(run, Run):
        return run
    if isinstance(run, Simulation):
        raise InputError("a Simulation is drawn from its folder: simulate(…, output=folder), then the folder")
    found = read(folder_file(run, "run.h5"))
    if not isinstance(found, Run):
        raise InputError(f"{run} is no run of haloray")
    return found


def group_of(run: Run, name: str) -> dict[str, Any]:
    """A group of a run."""
    found: Any = run.groups
    for part in name.split("/"):
        if part not in found:
            raise InputError(f"{run.path} has no group {name}")
        found = found[part]
    return found  # type: ignore[no-any-return]


def columns_of(place: Any, name: str) -> dict[str, Any]:
    """Columns of a table: a mapping or data frame, or a .csv of a study's folder."""
    if isinstance(place, (str, os.PathLike)):
        with open(folder_file(cast("str | os.PathLike[str]", place), name), newline="", encoding="utf-8") as file:
            rows = list(csv.reader(line for line in file if not line.startswith("#")))
        names, values = rows[0], rows[1:]
        return {own: _numbers([row[i] for row in values]) for i, own in enumerate(names)}
    return {str(own): np.asarray(place[own]) for own in place}


def json_of(place: Any, name: str) -> Any:
    """What a .json of a folder holds."""
    with open(folder_file(place, name), encoding="utf-8") as file:
        return json.load(file)


def _numbers(texts: list[str]) -> Any:
    try:
        return np.array([float(own) if own else np.nan for own in texts])
    except ValueError:
        return np.array(texts)


def half_of(n: int, scale: float) -> float:
    """Half the width of so many pixels."""
    return 0.5 * n * scale


__all__ = ["Array", "RunLike", "columns_of", "group_of", "half_of", "json_of", "run_of"]
