"""The corner plot of any columns of draws."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from .._errors import InputError
from .._units import Array, names_in
from . import density
from .labels import most_physical, symbol_of
from .style import BLACK, COLUMN_MM, CYCLE, PAGE_MM, finite, pyplot, quantile, styled, text

if TYPE_CHECKING:
    from matplotlib.figure import Figure, SubFigure

FRACTIONS, OPACITIES = (0.68, 0.95), (0.35, 0.2)


@styled
def corner(
    sets: Mapping[str, Mapping[str, Array]],
    names: Sequence[str] | None = None,
    figure: Figure | SubFigure | None = None,
    *,
    truths: Mapping[str, float] | None = None,
) -> Any:
    """The draws of one fit or several, by the names of fits and quantities; eight quantities unless named."""
    known = list(dict.fromkeys(name for draws in sets.values() for name in draws))
    chosen = most_physical(known) if names is None else names_in("names", names)
    unknown = [name for name in chosen if name not in known]
    if not chosen:
        raise InputError("names are none, but must be at least one")
    if unknown:
        raise InputError(f"{unknown[0]} is no quantity of the fit, which has {', '.join(known)}")
    columns = [(name, [draws.get(own) for own in chosen]) for name, draws in sets.items()]
    values = [None if truths is None else truths.get(name) for name in chosen]
    return draw([symbol_of(name) for name in chosen], columns, values, figure)


def draw(
    labels: Sequence[str],
    sets: Sequence[tuple[str, Sequence[Array | None]]],
    truths: Sequence[float | None],
    figure: Any,
) -> Any:
    """Contours of every pair of quantities, every quantity on the diagonal; one colour a set of draws."""
    n = len(labels)
    width = COLUMN_MM if n <= 3 else PAGE_MM if n <= 8 else 23.0 * n
    if figure is None:
        figure = pyplot().figure(figsize=(width / 25.4, width / 25.4))
    inches = figure.bbox.width / figure.bbox.height * width / 25.4
    edges = {
        "left": 0.62 / (width / 25.4),
        "right": 0.985,
        "bottom": 0.5 / inches,
        "top": 1.0 - (0.12 + 0.13 * len(sets)) / inches,
    }
    axes = figure.subplots(n, n, squeeze=False, gridspec_kw={**edges, "wspace": 0.07, "hspace": 0.07 + 0.035 * n})
    limits = [_limits([draws[i] for _, draws in sets], truths[i]) for i in range(n)]
    for row in range(n):
        for column in range(n):
            ax = axes[row, column]
            if column > row:
                ax.set_axis_off()
                continue
            ax.set_xlim(limits[column])
            if column == row:
                _diagonal(ax, labels[row], [draws[row] for _, draws in sets], truths[row], 2 * row < n)
            else:
                _pair(ax, [(draws[column], draws[row]) for _, draws in sets])
                ax.set_ylim(limits[row])
                if truths[row] is not None:
                    ax.axhline(truths[row], ls="--", lw=0.6, color=BLACK)
            if truths[column] is not None:
                ax.axvline(truths[column], ls="--", lw=0.6, color=BLACK)
            _outer(ax, labels, row, column, n)
    _legend(axes[0, n - 1] if n > 1 else axes[0, 0], sets, truths)
    return figure


def _limits(draws: Sequence[Array | None], truth: float | None) -> tuple[float, float]:
    ends = [(quantile(own, 0.002), quantile(own, 0.998)) for own in draws if own is not None and len(finite(own))]
    values = [value for pair in ends for value in pair if value is not None]
    if truth is not None and np.isfinite(truth):
        values.append(truth)
    if not values:
        return 0.0, 1.0
    low, high = min(values), max(values)
    room = 0.12 * (high - low) or 0.5 * abs(low) or 1.0
    return low - room, high + room


def _diagonal(ax: Any, label: str, draws: Sequence[Array | None], truth: float | None, is_left: bool) -> None:
    told: list[tuple[str, str]] = []
    for number, own in enumerate(draws):
        found = None if own is None else density.curve(own)
        if own is None or found is None:
            continue
        colour = CYCLE[number % len(CYCLE)]
        ax.fill_between(*found, color=colour, alpha=0.1, lw=0.0)
        ax.plot(*found, color=colour, lw=1.0)
        told.append((f"{label} = {density.interval(own)}", colour if len(draws) > 1 else BLACK))
    ax.set_ylim(0.0, 1.12)
    side, at = ("left", 0.0) if is_left else ("right", 1.0)
    for line, (words, colour) in enumerate(reversed(told)):
        ax.annotate(
            text(words),
            (at, 1.0),
            (0.0, 3.0 + 9.0 * line),
            "axes fraction",
            "offset points",
            ha=side,
            color=colour,
            annotation_clip=False,
        )


def _pair(ax: Any, draws: Sequence[tuple[Array | None, Array | None]]) -> None:
    for number, (x, y) in enumerate(draws):
        found = None if x is None or y is None else density.field(x, y, FRACTIONS)
        if found is None:
            continue
        nodes_x, nodes_y, values, levels = found
        colour = CYCLE[number % len(CYCLE)]
        for level, opacity in zip(reversed(levels), reversed(OPACITIES)):
            ax.contourf(nodes_x, nodes_y, values, [level, np.inf], colors=[colour], alpha=opacity)
            ax.contour(nodes_x, nodes_y, values, [level], colors=[colour], linewidths=0.7)


def _outer(ax: Any, labels: Sequence[str], row: int, column: int, n: int) -> None:
    from matplotlib.ticker import MaxNLocator

    most = 2 if n > 2 else 3
    # Numbers at the ends would meet those of the next panel.
    ax.xaxis.set_major_locator(MaxNLocator(most + 1, prune="both", min_n_ticks=1))
    ax.yaxis.set_major_locator(MaxNLocator(most + 1, prune="both", min_n_ticks=1))
    if row == n - 1:
        ax.set_xlabel(text(labels[column]))
    else:
        ax.tick_params(labelbottom=False)
    if column == 0 and row > 0:
        ax.set_ylabel(text(labels[row]))
    else:
        ax.tick_params(labelleft=False)


def _legend(ax: Any, sets: Sequence[tuple[str, Any]], truths: Sequence[float | None]) -> None:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    handles: list[Any] = []
    if len(sets) > 1:
        colours = [CYCLE[number % len(CYCLE)] for number in range(len(sets))]
        handles = [Patch(fc=own + "59", ec=own, label=name) for (name, _), own in zip(sets, colours)]
    if any(truth is not None for truth in truths):
        handles.append(Line2D([], [], ls="--", lw=0.6, color=BLACK, label="truth"))
    if handles:
        ax.legend(handles=handles, loc="upper right")
