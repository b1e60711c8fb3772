"""Arguments of lenstronomy's ``LensModel`` as haloray takes them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ._errors import InputError
from ._haloray import lens_model_names
from ._units import Array, Points, number, refuse

#: Names that a ``lens_model_list`` may hold.
LENS_MODELS: tuple[str, ...] = tuple(lens_model_names)


#: Those of a line of sight, of which a list may hold one.
LOS_MODELS: tuple[str, ...] = tuple(name for name in LENS_MODELS if name.startswith("LOS"))


Kwargs = Sequence[Mapping[str, Any]]


def source_of(points: Points, x: Any, y: Any) -> tuple[Array, Array]:
    source = Points(("x_source", "y_source"), x, y)
    try:
        x, y = (np.broadcast_to(own.reshape(source.shape), points.shape) for own in (source.x, source.y))
    except ValueError as error:
        raise InputError(
            f"x_source is of shape {source.shape}, but must have that of x_image, {points.shape}, or be a number"
        ) from error
    return np.ascontiguousarray(x).reshape(-1), np.ascontiguousarray(y).reshape(-1)


def has_quantities(kwargs: Any) -> bool:
    try:
        return any(hasattr(value, "to_value") for model in kwargs for value in model.values())
    except (AttributeError, TypeError):
        return False


def without_quantities(kwargs: Kwargs) -> Kwargs:
    def plain(name: str, value: Any) -> Any:
        if not hasattr(value, "to_value"):
            return value
        kind = str(getattr(getattr(value, "unit", None), "physical_type", ""))
        return number(name, value, "arcsec" if "angle" in kind else None)

    return [{name: plain(name, value) for name, value in model.items()} for model in kwargs]


_DEFAULTS: dict[str, Any] = {
    "observed_convention_index": None,
    "z_source_convention": None,
    "z_lens_convention": None,
    "cosmo_interp": False,
    "z_interp_stop": None,
    "num_z_interp": 100,
    "profile_kwargs_list": None,
    "decouple_multi_plane": False,
    "kwargs_multiplane_model": None,
    "distance_ratio_sampling": False,
    "cosmology_sampling": False,
    "cosmology_model": "FlatLambdaCDM",
    "use_jax": False,
}


#: Arguments that only say how lenstronomy computes.
_HARMLESS = ("cosmo_interp", "z_interp_stop", "num_z_interp", "use_jax")


def refuse_unsupported(unsupported: dict[str, Any], z_source: Any) -> None:
    for name, value in unsupported.items():
        if name not in _DEFAULTS:
            raise TypeError(f"LensModel has no argument {name}")
        if name in _HARMLESS or (name == "z_source_convention" and value == z_source):
            continue
        if value is not None and value != _DEFAULTS[name]:
            raise refuse(name, value, f"{_DEFAULTS[name]!r}: haloray.LensModel does not have it")
