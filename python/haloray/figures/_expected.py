"""Figures of the γ_LOS that is to be expected of lenses."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any

import numpy as np

from .._drawing.style import CYCLE, finite, grid, single, styled, text
from .._ensemble import Ensemble
from .._errors import InputError
from .._haloray import read_groups
from .._read import folder_file
from ._saved import columns_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure, SubFigure

#: Lenses that are drawn.
MOST_LENSES = 6


@styled
def expected(study: Ensemble | str | os.PathLike[str], figure: Figure | SubFigure | None = None) -> Any:
    """Draw which part of the sightlines has a smaller \\|γ_LOS\\|, by what it is averaged over, of the first six lenses.

    Parameters
    ----------
    study : haloray.Ensemble or path
        The folder of ``haloray study expected``, its sightlines.h5, or an ensemble.
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
    own, lenses = _sightlines(study)
    discs = [name.removeprefix("gamma1_los_disc_") for name in own if name.startswith("gamma1_los_disc_")]
    kinds = {"axis": "los", "ring": "los_ring", **{f"disc {radius}″": f"los_disc_{radius}" for radius in discs}}
    parts = np.linspace(0.0, 1.0, 401)
    labels = [f"|γ^{{LOS}}|, {name} ({z_lens:g}, {z_source:g})" for name, z_lens, z_source in lenses[:MOST_LENSES]]
    figure, axes = grid(figure, max(len(labels), 1), 2, 0.7)
    for number, (ax, label) in enumerate(zip(axes, labels or ["|γ^{LOS}|"])):
        rows = own["lens"] == number if labels else slice(None)
        for i, (name, rest) in enumerate(kinds.items()):
            sizes = np.sort(finite(np.hypot(own[f"gamma1_{rest}"][rows], own[f"gamma2_{rest}"][rows])))
            ranks = np.floor(parts * (len(sizes) - 1) + 0.5).astype(int)
            ax.plot(*((sizes[ranks], parts) if len(sizes) else ([], [])), **_stroke(i), label=text(name))
        ax.set(xlabel=text(label), ylabel="part of the sightlines below", ylim=(0.0, 1.0))
        ax.legend(loc="lower right")
    return figure


@styled
def smoothing(table: Any, ax: Axes | None = None) -> Axes:
    """Draw how the spread of γ_LOS falls with the radius over which it is averaged, from the Einstein ring on.

    Parameters
    ----------
    table : path, mapping or DataFrame
        The folder of ``haloray study expected``, its expected.csv, or its columns; the first six lenses are drawn.
    ax : matplotlib Axes, optional
        Where to draw.

    Returns
    -------
    matplotlib Axes
        What was drawn into.

    Raises
    ------
    OSError
        No such file.
    KeyError
        A table without the columns that are drawn.
    """
    own = columns_of(table, "expected.csv")
    radius, sigma, error = (own[name] for name in ("radius_arcsec", "sigma_gamma_los", "sigma_gamma_los_error"))
    axes = single(ax, 0.8)
    panel: Any = axes
    highest = 0.0
    starts = np.flatnonzero(own["averaged_over"] == "axis")
    for i, lens in enumerate(np.split(np.arange(len(radius)), starts[1:])[:MOST_LENSES]):
        rows = lens[radius[lens] > 0.0]
        low, high, name = (sigma - error)[rows], (sigma + error)[rows], own["name"][lens[0]]
        highest = max(highest, float(finite(high).max(initial=0.0)))
        panel.fill_between(radius[rows], low, high, color=CYCLE[i % 5], alpha=0.25, lw=0.0)
        # Lenses without a name are numbered.
        label = str(name) if isinstance(name, str) else f"{name:g}"
        panel.plot(radius[rows], sigma[rows], **_stroke(i), label=label)
    panel.set(xscale="log", xlabel="averaged over, radius [arcsec]", ylabel=text("σ of a component of γ^{LOS}"))
    # Room for the legend.
    panel.set_ylim(0.0, 1.5 * highest or 1.0)
    panel.legend(loc="upper right")
    return axes


def _sightlines(study: Any) -> tuple[dict[str, Any], list[tuple[str, float, float]]]:
    """The columns of the sightlines, and name and redshifts of each lens."""
    if isinstance(study, Ensemble):
        return dict(study.columns), [lens[:3] for lens in study._plan.lenses]
    groups, *_ = read_groups(folder_file(study, "sightlines.h5"))
    if "sightlines" not in groups:
        raise InputError(f"{study} is no ensemble of haloray")
    lenses = groups.get("lenses", {"name": [], "z_lens": [], "z_source": []})
    return groups["sightlines"], list(zip(*(lenses[name] for name in ("name", "z_lens", "z_source"))))


def _stroke(i: int) -> dict[str, Any]:
    """Of the colours, that of a curve; dashed where they begin anew."""
    return {"color": CYCLE[i % len(CYCLE)], "ls": "-" if i < len(CYCLE) else "--"}
