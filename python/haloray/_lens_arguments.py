"""Arguments of lenstronomy's ``LensModel`` as haloray takes them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ._errors import InputError
from ._haloray import lens_argument_unit, lens_model_names
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


def without_quantities(models: Sequence[str], kwargs: Kwargs) -> Kwargs:
    """Quantities as numbers in the unit of their argument; names that a model does not have are refused where it is built."""

    def plain(model: str, name: str, value: Any) -> Any:
        unit = lens_argument_unit(model, name)
        return number(name, value, unit or None) if unit is not None and hasattr(value, "to_value") else value

    return [
        {name: plain(model, name, value) for name, value in own.items()} for model, own in zip(models, kwargs, strict=False)
    ] + list(kwargs[len(models) :])


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
        default = _DEFAULTS[name]
        is_default = value is default or (isinstance(value, (str, bool)) and value == default)
        if value is not None and not is_default:
            raise refuse(name, value, f"{_DEFAULTS[name]!r}: haloray.LensModel does not have it")
