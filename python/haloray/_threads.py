"""How many threads work."""

from __future__ import annotations

from . import _haloray
from ._units import whole


def set_threads(number: int) -> None:
    """Set how many threads work from now on; results do not depend on it.

    Parameters
    ----------
    number : int
        Threads of this process; 0 for all cores.

    Raises
    ------
    InputError
        A number that is negative, or no whole number.
    """
    _haloray.set_threads(whole("number", number, 0, 4096))


def number_of_threads() -> int:
    """Tell how many threads work.

    Returns
    -------
    int
        Threads of this process.
    """
    return _haloray.number_of_threads()


__all__ = ["number_of_threads", "set_threads"]
