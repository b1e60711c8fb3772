"""What runs here."""

from __future__ import annotations

import sys

from ._haloray import __version__, git_revision
from ._threads import number_of_threads

_PACKAGES = ("numpy", "scipy", "astropy", "lenstronomy", "pyhalo", "xarray", "arviz", "matplotlib", "tqdm")


def show_versions() -> str:
    """Tell what runs here, as text to send with a report.

    Returns
    -------
    str
        Versions of haloray, Python and the packages that work with it, and the number of threads.
    """
    # Both take longer to import than all else.
    import importlib.metadata
    import platform

    lines = [
        f"haloray      {__version__} ({git_revision})",
        f"python       {sys.version.split()[0]} on {platform.platform()}",
        f"threads      {number_of_threads()}",
    ]
    for name in _PACKAGES:
        try:
            lines.append(f"{name:<12} {importlib.metadata.version(name)}")
        except importlib.metadata.PackageNotFoundError:
            lines.append(f"{name:<12} not installed")
    return "\n".join(lines)


__all__ = ["show_versions"]
