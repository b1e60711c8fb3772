"""Figures of ensembles."""

from __future__ import annotations

import os
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from .._drawing import corner as _corner
from .._drawing.style import CYCLE, GREY, finite, outline, panels, quantile, single, styled, text
from .._ensemble import Ensemble
from .._read import open_ensemble
from .._units import Array, refuse

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure, SubFigure

F_G = "|F_{os}|, |G_{os}| [arcsec^{−1}]"


@styled
def distributions(ensemble: Any, figure: Figure | SubFigure | None = None) -> Any:
    """Draw how γ_LOS, κ, Δ_tot, F and G are distributed over the sightlines.

    Parameters
    ----------
    ensemble : haloray.Ensemble, xarray.Dataset or path
        An ensemble, its group ``sightlines``, or the folder of ``haloray ensemble``.
    figure : matplotlib Figure or SubFigure, optional
        Where to draw.

    Returns
    -------
    matplotlib Figure or SubFigure
        What was drawn into.

    Raises
    ------
    InputError
        A file that is no ensemble.
    MissingFileError
        No such file.
    """
    own = _columns(ensemble)
    kinds: list[tuple[str, bool, list[tuple[str, Array]]]] = [
        (
            "γ^{LOS}",
            False,
            [(f"γ_{{{i}}}, {where}", own(f"gamma{i}_los{end}")) for where, end in AXIS_AND_RING for i in (1, 2)],
        ),
        (
            "κ",
            False,
            [
                ("κ_{LOS}, axis", own("kappa_los")),
                ("κ_{LOS}, ring", own("kappa_los_ring")),
                ("κ_{os}, axis", own("kappa_os")),
            ],
        ),
        (
            "Δ_{tot}",
            True,
            [("two points", own("delta_tot")), ("ring", own("delta_tot_ring")), ("disc", own("delta_tot_disc"))],
        ),
        (
            F_G,
            True,
            [
                (f"{name}, {where}", _modulus(own, name, f"os{end}_per_arcsec"))
                for where, end in (("axis", ""), ("disc", "_disc"))
                for name in "FG"
            ],
        ),
    ]
    figure, axes = panels(figure, 2, 2, 0.7)
    for ax, (label, is_log, sets) in zip(axes.flat, kinds):
        edges, tallest = _edges(sets, is_log), 1.0
        for i, (name, values) in enumerate(sets):
            counts = np.histogram(values[np.isfinite(values)], edges)[0] if len(edges) else np.zeros(0)
            tallest = max(tallest, float(counts.max(initial=0)))
            outline(ax, counts, edges, CYCLE[i], name)
        ax.set(xlabel=text(label), ylabel="sightlines", ylim=(0.0, 1.45 * tallest))
        if is_log:
            ax.set_xscale("log")
        ax.legend(loc="upper left")
        outside = max(_outside(values, edges, is_log) for _, values in sets)
        if outside:
            ax.set_title(f"up to {outside} outside", fontsize=7, loc="right", pad=3, color=GREY)
    return figure


@styled
def joint(ensemble: Any, figure: Figure | SubFigure | None = None) -> Any:
    """Draw the joint distribution of γ_LOS, κ_LOS along the ring, Δ_tot, F and G.

    Parameters
    ----------
    ensemble
        See :func:`distributions`.
    figure : matplotlib Figure or SubFigure, optional
        Where to draw.

    Returns
    -------
    matplotlib Figure or SubFigure
        What was drawn into.

    Raises
    ------
    InputError
        A file that is no ensemble.
    MissingFileError
        No such file.
    """
    own = _columns(ensemble)
    with np.errstate(divide="ignore", invalid="ignore"):
        columns = {
            "γ_{1}^{LOS}, ring": own("gamma1_los_ring"),
            "γ_{2}^{LOS}, ring": own("gamma2_los_ring"),
            "κ_{LOS}, ring": own("kappa_los_ring"),
            "log_{10} Δ_{tot}": np.log10(own("delta_tot")),
            "log_{10} |F|, disc": np.log10(_modulus(own, "F", "os_disc_per_arcsec")),
            "log_{10} |G|, disc": np.log10(_modulus(own, "G", "os_disc_per_arcsec")),
        }
    whole = np.isfinite(list(columns.values())).all(axis=0)
    draws = [values[whole] for values in columns.values()]
    return _corner.draw(list(columns), [("", draws)], [None] * len(columns), figure)


@styled
def settling(ensemble: Any, ax: Axes | None = None) -> Axes:
    """Draw how √⟨\\|γ_LOS\\|²⟩ over the first N sightlines settles with N.

    Parameters
    ----------
    ensemble
        See :func:`distributions`.
    ax : matplotlib Axes, optional
        Where to draw.

    Returns
    -------
    matplotlib Axes
        What was drawn into.

    Raises
    ------
    InputError
        A file that is no ensemble.
    MissingFileError
        No such file.
    """
    own = _columns(ensemble)
    axes = single(ax, 0.8)
    panel: Any = axes
    for (name, end), colour in zip(AXIS_AND_RING, CYCLE):
        power = finite(_modulus(own, "gamma", f"los{end}")) ** 2
        n = np.arange(1, len(power) + 1)
        mean = np.cumsum(power) / n
        variance = np.maximum(np.cumsum(power**2) / n - mean**2, 0.0)
        shown = n >= 10
        n, rms = n[shown], np.sqrt(mean[shown])
        error = np.sqrt(variance[shown] / n) / (2.0 * rms)
        panel.fill_between(n, rms - error, rms + error, color=colour, alpha=0.25, lw=0.0)
        panel.plot(n, rms, color=colour, lw=1.0, label=name)
    panel.set(xscale="log", xlabel="sightlines", ylabel=text("√⟨|γ_{LOS}|^{2}⟩"))
    panel.legend(loc="upper right")
    return axes


AXIS_AND_RING = (("axis", ""), ("ring", "_ring"))


def _columns(ensemble: Any) -> Callable[[str], Array]:
    """A function from the name of a column to its values; none of one that is missing."""
    own: dict[str, Any]
    if isinstance(ensemble, Ensemble):
        own = dict(ensemble.columns)
    else:
        is_path = isinstance(ensemble, (str, os.PathLike))
        opened = open_ensemble(cast("str | os.PathLike[str]", ensemble)) if is_path else ensemble
        if not hasattr(opened, "data_vars"):
            raise refuse("ensemble", ensemble, "a haloray.Ensemble, an xarray Dataset, or the folder of one")
        own = {str(name): opened[name].values for name in opened.data_vars}
    count = len(next(iter(own.values()), ()))
    return lambda name: np.asarray(own.get(name, np.full(count, np.nan)), dtype=np.float64)


def _modulus(own: Callable[[str], Array], quantity: str, rest: str) -> Array:
    return np.hypot(own(f"{quantity}1_{rest}"), own(f"{quantity}2_{rest}"))


def _edges(sets: list[tuple[str, Array]], is_log: bool) -> Array:
    """Edges of 40 equal bins over the middle 98% of the values and a quarter of that on both sides, no farther than they go."""
    values = finite([own for _, own in sets])
    values = np.log10(values[values > 0.0]) if is_log else values
    low, high = quantile(values, 0.01), quantile(values, 0.99)
    if low is None or high is None or low >= high:
        return np.zeros(0)
    room = 0.25 * (high - low)
    edges = np.linspace(max(low - room, values.min()), min(high + room, values.max()), 41)
    return 10.0**edges if is_log else edges


def _outside(values: Array, edges: Array, is_log: bool) -> int:
    """How many values that have a place on the axis lie beyond its bins."""
    placed = values[np.isfinite(values) & ((values > 0.0) | (not is_log))]
    return int(np.sum((placed < edges[0]) | (placed > edges[-1]))) if len(edges) else 0
