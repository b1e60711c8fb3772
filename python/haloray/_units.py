"""Numbers, arrays and quantities at the border: what comes in is a float64 column or an error that names the argument."""

from __future__ import annotations

import operator
import os
from collections.abc import Mapping, Sequence
from typing import Any, TypeVar, cast

import numpy as np
from numpy.typing import NDArray

from ._errors import InputError

Array = NDArray[np.float64]
_Kind = TypeVar("_Kind")


def refuse(name: str, value: object, allowed: str) -> InputError:
    """The error of an argument that is something else than allowed."""
    text = repr(value)
    return InputError(f"{name} is {text if len(text) < 80 else text[:77] + '...'}, but must be {allowed}")


def expect(name: str, value: object, kind: type[_Kind], allowed: str) -> _Kind:
    """``value``, if it is of that kind."""
    if not isinstance(value, kind):
        raise refuse(name, value, allowed)
    return value


def flag(name: str, value: object) -> bool:
    """``value`` as a bool, if it is one of Python or numpy."""
    if not is_flag(value):
        raise refuse(name, value, "True or False")
    return bool(cast("Any", value))


def is_flag(value: object) -> bool:
    """Whether it is a bool of Python or numpy."""
    return isinstance(value, (bool, np.bool_))


def path_of(name: str, value: object) -> str:
    """``value`` as the path of a file or folder."""
    path: object = os.fspath(cast("os.PathLike[str]", value)) if isinstance(value, os.PathLike) else value
    return expect(name, path, str, "a path")


def one_of(name: str, value: object, allowed: Sequence[str]) -> str:
    """``value``, if it is one of the names allowed."""
    if not isinstance(value, str) or value not in allowed:
        raise refuse(name, value, f"one of {', '.join(allowed)}")
    return value


def mapping(name: str, value: object, allowed: str) -> Mapping[str, Any]:
    """``value``, if it is a dictionary or another mapping."""
    if not isinstance(value, Mapping):
        raise refuse(name, value, allowed)
    return cast("Mapping[str, Any]", value)


def items(name: str, value: Any, allowed: str) -> list[Any]:
    """What a list, or anything else that has an order and is no text, holds."""
    has_no_order = _has_no_order(value)
    try:
        found: list[Any] = [] if has_no_order else list(value)
    except TypeError as error:
        raise refuse(name, value, allowed) from error
    if has_no_order:
        raise refuse(name, value, allowed)
    return found


def _has_no_order(value: object) -> bool:
    return isinstance(value, (str, bytes, Mapping))


def names_in(name: str, value: Any) -> list[str]:
    """The names of a list."""
    return [expect(name, own, str, "a list of names") for own in items(name, value, "a list of names")]


def _plain(name: str, value: Any, unit: str | None) -> Any:
    """A quantity as numbers of ``unit``; anything else as it is."""
    if not (hasattr(value, "to_value") and hasattr(value, "unit")):
        return value
    try:
        return value.to_value(unit or "")
    except (TypeError, ValueError) as error:
        raise refuse(name, value, f"in {unit or 'no unit'}") from error


def array(name: str, value: Any, unit: str | None = None) -> Array:
    """``value`` as a contiguous float64 array in native byte order, of any shape; not copied where it is one already."""
    value = _plain(name, value, unit)
    if _is_masked(value):
        raise InputError(f"{name} has masked values, but must have none")
    try:
        found: NDArray[Any] = np.asarray(value)
    except (TypeError, ValueError) as error:
        raise refuse(name, value, "an array of numbers") from error
    if found.dtype.kind not in "fiu":
        raise InputError(f"{name} is an array of {found.dtype}, but must be of real numbers")
    # numpy makes a 0-d array one of one number here.
    return np.ascontiguousarray(found, dtype=np.float64).reshape(found.shape)


def _is_masked(value: object) -> bool:
    return isinstance(value, np.ma.MaskedArray) and bool(np.ma.is_masked(cast("NDArray[Any]", value)))


def column(name: str, value: Any, unit: str | None = None) -> Array:
    """``value`` as a column of float64."""
    found = array(name, value, unit)
    if found.ndim != 1:
        raise InputError(f"{name} is of shape {found.shape}, but must have one dimension")
    return found


def image(name: str, value: Any, unit: str | None = None) -> Array:
    """``value`` as a square image (y, x) of float64."""
    found = array(name, value, unit)
    if found.ndim != 2 or found.shape[0] != found.shape[1] or found.size == 0:
        raise InputError(f"{name} is of shape {found.shape}, but must be square, (n, n)")
    return found


def centred(n: int) -> Array:
    """Places of n pixels or nodes about their middle, in units of their distance."""
    return np.arange(n, dtype=np.float64) - 0.5 * (n - 1)


def number(name: str, value: Any, unit: str | None = None) -> float:
    """``value`` as one float."""
    value = _plain(name, value, unit)
    if isinstance(value, (str, bytes, bool)):
        raise refuse(name, value, "a number")
    try:
        return float(value)
    except (TypeError, ValueError, OverflowError) as error:
        raise refuse(name, value, "a number") from error


def optional(name: str, value: Any, unit: str | None = None) -> float | None:
    """``value`` as one float, or None."""
    return None if value is None else number(name, value, unit)


def whole(name: str, value: Any, low: int = 0, high: int = 2**63 - 1) -> int:
    """``value`` as an integer from ``low`` to ``high``."""
    try:
        found = operator.index(value)
    except TypeError as error:
        raise refuse(name, value, "a whole number") from error
    if isinstance(value, bool) or not low <= found <= high:
        raise refuse(name, value, f"a whole number from {low} to {high}")
    return found


class Points:
    """Directions on the sky: two arrays of one shape, or two numbers, as columns and back."""

    __slots__ = ("shape", "x", "y")

    def __init__(self, names: tuple[str, str], x: Any, y: Any) -> None:
        first, second = array(names[0], x, "arcsec"), array(names[1], y, "arcsec")
        if first.shape != second.shape:
            try:
                shape = np.broadcast_shapes(first.shape, second.shape)
                first, second = np.broadcast_to(first, shape), np.broadcast_to(second, shape)
            except ValueError as error:
                raise InputError(
                    f"{names[1]} is of shape {second.shape}, but must have that of {names[0]}, {first.shape}"
                ) from error
        self.shape: tuple[int, ...] = first.shape
        self.x: Array = np.ascontiguousarray(first.reshape(-1))
        self.y: Array = np.ascontiguousarray(second.reshape(-1))

    def shaped(self, values: Array) -> Any:
        """Values of the points, the first axis of ``values``, in the shape that the points came in."""
        if self.shape == () and values.ndim == 1:
            return float(values[0])
        return values.reshape(self.shape + values.shape[1:])
