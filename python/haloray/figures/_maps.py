"""Maps over the field of the image."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from .._drawing.style import bar, circle, log_norm, panels, raster, styled, symmetric
from .._read import Run
from ._lens import curves_of_group, lay_over
from ._saved import group_of, run_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure, SubFigure


@styled
def tidal_maps(
    maps: Any, figure: Figure | SubFigure | None = None, *, einstein_radius_arcsec: float | None = None
) -> Any:
    """Draw κ, γ1 and γ2 side by side about their values on the axis.

    Parameters
    ----------
    maps : path, Run or xarray.Dataset
        A run's folder or file, maps.h5 of ``haloray map``, or :meth:`haloray.LineOfSight.maps`.
    figure : matplotlib Figure or SubFigure, optional
        Where to draw.
    einstein_radius_arcsec : float, optional
        Of the dashed circle; that of the run's lens unless given, none for maps alone.

    Returns
    -------
    matplotlib Figure or SubFigure
        What was drawn into.

    Raises
    ------
    InputError
        What is no run, or one without what is drawn.
    MissingFileError
        No such file.
    """
    grids, centres, half, radius, found = _of(maps, einstein_radius_arcsec)
    figure, axes = panels(figure, 1, 3, 1.0, extra_mm=9.0)
    for i, (name, symbol) in enumerate([("kappa", "κ"), ("gamma1", "γ_{1}"), ("gamma2", "γ_{2}")]):
        centre = centres.get(name, float("nan"))
        told = symbol
        if np.isfinite(centre) and centre != 0.0:
            told += f"  (white: axis, {centre:.4f})".replace("-", "−")
        norm = symmetric(grids[name], 0.98, centre if np.isfinite(centre) else 0.0)
        shown = raster(axes[0, i], grids[name], half, norm, "RdBu_r", i == 0)
        bar(figure, shown, axes[0, i], told)
        circle(axes[0, i], radius, "RdBu_r")
        lay_over(axes[0, i], found, "black")
    return figure


@styled
def flexion_maps(
    maps: Any, figure: Figure | SubFigure | None = None, *, einstein_radius_arcsec: float | None = None
) -> Any:
    """Draw \\|F\\| = \\|∂γ\\|, \\|G\\| = \\|∂*γ\\| and Δ, the change of the shear over the image, side by side.

    Parameters
    ----------
    maps, figure, einstein_radius_arcsec
        See :func:`tidal_maps`.

    Returns
    -------
    matplotlib Figure or SubFigure
        What was drawn into.

    Raises
    ------
    InputError
        What is no run, or one without what is drawn.
    MissingFileError
        No such file.
    """
    grids, _, half, radius, found = _of(maps, einstein_radius_arcsec)
    figure, axes = panels(figure, 1, 3, 1.0, extra_mm=9.0)
    rows = [
        ("abs_f", "|F| [arcsec^{−1}]", "viridis"),
        ("abs_g", "|G| [arcsec^{−1}]", "viridis"),
        ("delta", "Δ", "magma"),
    ]
    for i, (name, label, cmap) in enumerate(rows):
        shown = raster(axes[0, i], grids[name], half, log_norm(grids[name], 0.99), cmap, i == 0)
        bar(figure, shown, axes[0, i], label)
        circle(axes[0, i], radius, cmap)
        lay_over(axes[0, i], found, "white")
    return figure


def _of(maps: Any, radius: float | None) -> tuple[dict[str, Any], dict[str, float], float, float, list[Any]]:
    """Maps by name, values on the axis, half the width out to the edges of the outermost cells, Einstein radius, curves."""
    if isinstance(maps, (Run, str, os.PathLike)):
        run = maps if isinstance(maps, Run) else _run_of_maps(cast("str | os.PathLike[str]", maps))
        grids, about = group_of(run, "maps"), run.attributes["maps"]
        centres = {name: about.get(f"{name}_on_axis", float("nan")) for name in ("kappa", "gamma1", "gamma2")}
        node = about["half_width_arcsec"]
        radius = run.setting("lens", "einstein_radius_arcsec") if radius is None else radius
        parent = "images/all_haloes/curves" if "images" in run.groups else "curves"
        found = curves_of_group(run, parent)
    else:
        grids = {str(name): maps[name].values for name in maps.data_vars}
        node, found = float(maps["theta_x"].values[-1]), []
        middle = maps.sel(theta_x=0.0, theta_y=0.0, method="nearest")
        centres = {name: float(middle[name]) for name in ("kappa", "gamma1", "gamma2")}
    n = grids["kappa"].shape[0]
    return grids, centres, node * n / (n - 1), radius or 0.0, found


def _run_of_maps(path: str | os.PathLike[str]) -> Run:
    """The run in a folder, or the maps of `haloray map` there; or in that file."""
    own = os.path.join(path, "maps.h5")
    return run_of(own if os.path.exists(own) else path)
