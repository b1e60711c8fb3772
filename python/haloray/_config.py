"""Configurations: what the command reads from TOML, from Python's own objects too."""

from __future__ import annotations

import copyreg
import json
import os
from collections.abc import Mapping
from typing import Any, Union, cast

import numpy as np
from numpy.typing import NDArray

from ._errors import InputError
from ._haloray import Config
from ._units import expect, number, path_of, refuse, whole

#: A preset's name, the path of a TOML file, a dictionary of the keys to change, or a resolved configuration.
ConfigLike = Union[str, "os.PathLike[str]", Mapping[str, Any], Config, None]

PRESETS = ("paper", "consistent")


def config(
    config: ConfigLike = None,
    *,
    preset: str = "paper",
    seed: int | None = None,
    draw: str | None = None,
    accuracy_arcsec: float | str | None = None,
) -> Config:
    """Resolve a configuration.

    Parameters
    ----------
    config : str, path, mapping or Config, optional
        A preset's name (``"paper"``, ``"consistent"``), the path of a TOML file, or the keys to change as nested
        dictionaries, such as ``{"haloes": {"min_point_shear": 1e-7}}``. ``haloray schema`` explains every key.
    preset : str
        What file or dictionary are laid over.
    seed : int, optional
        Seed of everything random, instead of the configuration's.
    draw : {"direct", "brute-force"}, optional
        How haloes are drawn.
    accuracy_arcsec : float or "exact", optional
        Largest error of a traced ray.

    Returns
    -------
    Config
        Every key resolved; ``config.toml`` shows them.

    Raises
    ------
    InputError
        An unknown key, a wrong type or a value outside its domain.
    MissingFileError
        No such file.
    """
    resolved = _resolve(config, expect("preset", preset, str, "a preset's name"))
    if seed is None and draw is None and accuracy_arcsec is None:
        return resolved
    seed = None if seed is None else whole("seed", seed)
    if accuracy_arcsec is not None and not isinstance(accuracy_arcsec, str):
        accuracy_arcsec = number("accuracy_arcsec", accuracy_arcsec, "arcsec")
    draw = None if draw is None else expect("draw", draw, str, '"direct" or "brute-force"')
    return resolved.with_options(seed, draw, accuracy_arcsec)


def _resolve(config: Any, preset: str) -> Config:
    if isinstance(config, Config):
        return config
    if config is None:
        return Config.of_file(preset, None)
    if isinstance(config, str) and config in PRESETS:
        return Config.of_file(config, None)
    if isinstance(config, str) and config.isalpha() and not os.path.exists(config):
        raise refuse("config", config, f"{' or '.join(map(repr, PRESETS))}, the path of a TOML file or a dictionary")
    if isinstance(config, (str, os.PathLike)):
        return Config.of_file(preset, path_of("config", cast("object", config)))
    if isinstance(config, Mapping):
        return Config.of_json(preset, as_json("config", cast("Mapping[str, Any]", config)))
    raise refuse("config", config, "a preset's name, the path of a TOML file or a dictionary")


def as_json(name: str, mapping: Mapping[str, Any]) -> str:
    """A dictionary of numbers, text and sections as JSON."""

    def plain(value: Any) -> object:
        if isinstance(value, (np.generic, np.ndarray)):
            return np.asarray(cast("NDArray[Any]", value)).tolist()
        if isinstance(value, os.PathLike):
            return os.fspath(cast("os.PathLike[str]", value))
        if isinstance(value, Mapping):
            return dict(cast("Mapping[str, object]", value))
        raise InputError(f"{name} holds {value!r}, but must hold numbers, text and sections")

    try:
        return json.dumps(dict(mapping), default=plain, allow_nan=False)
    except (TypeError, ValueError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f"{name} holds what is no number, text or section: {error}") from error


def of_toml(toml: str) -> Config:
    """The configuration of its own text."""
    return Config.of_complete_text(toml)


copyreg.pickle(Config, lambda config: (of_toml, (config.toml,)))
