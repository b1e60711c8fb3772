"""Other packages, imported when something needs them: the one border to what has no types, or may not be installed."""

from __future__ import annotations

import importlib
from typing import Any


def package(name: str, need: str, install: str = "") -> Any:
    """The module ``name``; without its package an ImportError that says what needs it and how to install it."""
    try:
        return importlib.import_module(name)
    except ImportError as error:
        raise ImportError(f"{need}: pip install {install or name.partition('.')[0]}") from error
