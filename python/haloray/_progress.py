"""Progress bars, where they are asked for."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Union

from ._errors import InputError
from ._packages import package

#: ``True`` for a tqdm bar in terminals and notebooks, or what is told of task, units done, units in all, and a message.
Progress = Union[bool, Callable[[str, int, "int | None", str], object], None]


def callback(progress: Progress) -> Callable[[str, int, int | None, str], object] | None:
    """What the native side is to call now and then."""
    if progress is None or progress is False:
        return None
    if progress is True:
        return _bar()
    if callable(progress):
        return progress
    raise InputError(f"progress is {progress!r}, but must be True, False or a function of (task, done, units, message)")


def _bar() -> Callable[[str, int, int | None, str], object]:
    tqdm = package("tqdm.auto", "progress=True needs tqdm").tqdm
    bars: dict[str, Any] = {}

    def tell(task: str, done: int, units: int | None, message: str) -> None:
        if task not in bars:
            for name in list(bars):
                bars.pop(name).close()
            bars[task] = tqdm(total=units, desc=task, leave=False)
        bar = bars[task]
        bar.n = done
        bar.set_postfix_str(message, refresh=False)
        bar.refresh()

    return tell
