"""Sizes, colours and the pieces that all figures share."""

from __future__ import annotations

import functools
import inspect
import re
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, ParamSpec, TypeVar, cast

import numpy as np

from .._packages import package
from .._units import Array, refuse

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.colors import Normalize
    from matplotlib.figure import Figure, SubFigure

#: Widths of a column and of a page of MNRAS.
COLUMN_MM, PAGE_MM = 84.0, 174.0
BLACK, WHITE, GREY, RED = "#000000", "#ffffff", "#6e6e6e", "#c81826"
BLUE, ORANGE, GREEN, PURPLE = "#0072b2", "#d55e00", "#009e73", "#cc79a7"
#: Colours of curves that stay apart for colour-blind readers (Okabe & Ito 2008).
CYCLE = (BLUE, ORANGE, GREEN, PURPLE, BLACK)
FLUX = "flux [e^{−} s^{−1} pixel^{−1}]"

#: matplotlib's settings for the figures: ``with matplotlib.rc_context(haloray.figures.STYLE): …``
STYLE: dict[str, Any] = {
    "font.family": "sans-serif",
    "font.sans-serif": ["DejaVu Sans"],
    "font.size": 7.0,
    "axes.labelsize": 8.0,
    "axes.linewidth": 0.6,
    "axes.labelpad": 2.5,
    "axes.formatter.use_mathtext": True,
    "legend.fontsize": 7.0,
    "legend.frameon": True,
    "legend.framealpha": 0.85,
    "legend.edgecolor": "white",
    "legend.borderpad": 0.2,
    "legend.handlelength": 1.8,
    "xtick.direction": "in",
    "ytick.direction": "in",
    "xtick.top": True,
    "ytick.right": True,
    "xtick.minor.visible": True,
    "ytick.minor.visible": True,
    "xtick.labelsize": 7.0,
    "ytick.labelsize": 7.0,
    **{f"{axis}tick.{kind}.width": 0.5 for axis in "xy" for kind in ("major", "minor")},
    **{f"{axis}tick.major.size": 3.6 for axis in "xy"},
    **{f"{axis}tick.minor.size": 2.0 for axis in "xy"},
    "lines.linewidth": 1.0,
    "patch.linewidth": 0.9,
    "image.interpolation": "nearest",
    "mathtext.fontset": "dejavusans",
    "savefig.dpi": 300,
}

_Arguments = ParamSpec("_Arguments")
_Result = TypeVar("_Result")


def pyplot() -> Any:
    """``matplotlib.pyplot``."""
    return package("matplotlib.pyplot", "figures are drawn with matplotlib")


def styled(function: Callable[_Arguments, _Result]) -> Callable[_Arguments, _Result]:
    """Draws in the style of haloray, into an Axes ``ax`` or a Figure ``figure`` if it is one."""
    signature = inspect.signature(function)

    @functools.wraps(function)
    def drawn(*arguments: _Arguments.args, **options: _Arguments.kwargs) -> _Result:
        given = signature.bind(*arguments, **options).arguments
        for name, method, allowed in (("ax", "plot", "Axes"), ("figure", "subplots", "Figure or SubFigure")):
            if given.get(name) is not None and not hasattr(given[name], method):
                raise refuse(name, given[name], f"a matplotlib {allowed}, or None")
        # The backend of notebooks, which starts now if it has not, sets what the end of the style would set back.
        pyplot().draw_if_interactive()
        with pyplot().rc_context(STYLE):
            return function(*arguments, **options)

    return drawn


def text(markup: str) -> str:
    """``γ_{1}^{LOS}`` as matplotlib writes it."""

    def script(own: re.Match[str]) -> str:
        return own[1] + r"{\mathrm{" + own[2].replace(" ", r"\ ") + "}}"

    def scripts(found: re.Match[str]) -> str:
        return "$" + re.sub(r"([_^])\{([^}]*)\}", script, found[0]) + "$"

    return re.sub(r"(?:[_^]\{[^}]*\})+", scripts, markup)


def panels(
    figure: Figure | SubFigure | None,
    rows: int,
    columns: int,
    aspect: float,
    width_mm: float = PAGE_MM,
    extra_mm: float = 0.0,
    **options: Any,
) -> tuple[Any, Any]:
    """A figure with a grid of panels, as wide as the page; ``extra_mm`` is the room of colour bars above."""
    width = width_mm / 25.4
    height = 0.86 * width / columns * aspect * rows + 0.25 * rows + extra_mm / 25.4
    found: Any = new_figure(width, height, 0.025, 0.02) if figure is None else figure
    return found, found.subplots(rows, columns, squeeze=False, **options)


def grid(
    figure: Figure | SubFigure | None,
    number: int,
    columns: int,
    aspect: float,
    width_mm: float = PAGE_MM,
    **options: Any,
) -> tuple[Any, list[Any]]:
    """A figure with so many panels, as many in a row as there are columns."""
    found, axes = panels(figure, -(-number // columns), columns, aspect, width_mm, **options)
    for ax in axes.flat[number:]:
        ax.set_axis_off()
    return found, list(axes.flat[:number])


def new_figure(width: float, height: float, pad: float, space: float) -> Any:
    """A figure of that size in inches whose panels find their places themselves."""
    from matplotlib.layout_engine import ConstrainedLayoutEngine

    layout = ConstrainedLayoutEngine(w_pad=pad, h_pad=pad, wspace=space, hspace=space)
    return pyplot().figure(figsize=(width, height), layout=layout)


def single(ax: Axes | None, aspect: float, width_mm: float = COLUMN_MM) -> Axes:
    """The panel that is to be drawn into: ``ax``, or one of a new figure. matplotlib does not type most of its keywords."""
    if ax is not None:
        return ax
    width = width_mm / 25.4
    figure = pyplot().figure(figsize=(width, 0.86 * width * aspect + 0.3), layout="constrained")
    found: Axes = figure.add_subplot()
    return found


def finite(values: Any) -> Array:
    """The finite values, flat."""
    flat = np.asarray(values, dtype=np.float64).ravel()
    return flat[np.isfinite(flat)]


def quantile(values: Any, part: float) -> float | None:
    """The value of the nearest rank; none without finite values."""
    found = np.sort(finite(values))
    return float(found[int(np.floor(part * (len(found) - 1) + 0.5))]) if len(found) else None


def steps(values: Any) -> tuple[Array, Array]:
    """The part of the positive values that lie below a value, in steps."""
    found = np.sort(finite(values))
    found = found[found > 0.0]
    heights = np.arange(len(found) + 1) / max(len(found), 1)
    return np.repeat(found, 2), np.stack([heights[:-1], heights[1:]], axis=1).ravel()


def symmetric(values: Any, coverage: float = 1.0, centre: float = 0.0) -> Normalize:
    """Linear about ``centre``, wide enough for the fraction ``coverage`` of the values."""
    from matplotlib.colors import Normalize

    width = quantile(np.abs(np.asarray(values) - centre), coverage) or 1.0
    return Normalize(centre - width, centre + width)


def log_norm(values: Any, coverage: float) -> Normalize:
    """Logarithmic, half of the rest of the positive values outside on each side."""
    from matplotlib.colors import LogNorm

    positive = finite(values)
    positive = positive[positive > 0.0]
    tail = 0.5 * (1.0 - coverage)
    low, high = quantile(positive, tail) or 0.1, quantile(positive, 1.0 - tail) or 1.0
    return LogNorm(low, high if high > low else 10.0 * low, clip=True)


def image_norm(grids: Sequence[Any], background: float) -> Normalize:
    """From just below the background, where it turns from linear to logarithmic, to the brightest pixel."""
    from matplotlib.colors import AsinhNorm

    brightest = max((quantile(grid, 1.0) or 0.0 for grid in grids), default=0.0)
    high = brightest if brightest > 0.0 else 1.0
    softening = background if background > 0.0 else 0.01 * high
    return AsinhNorm(softening, vmin=-2.0 * softening, vmax=high, clip=True)


def ink(cmap: str) -> tuple[str, str]:
    """The colour of what is written on a colour map, and that of an outline about it."""
    return (BLACK, WHITE) if cmap == "RdBu_r" else (WHITE, BLACK)


def raster(ax: Any, values: Any, half_width: Any, norm: Normalize, cmap: str, is_first: bool = True) -> Any:
    """An image about the axis, or over (left, right, bottom, top), y upwards."""
    around = (-1.0, 1.0, -1.0, 1.0)
    extent = cast("Any", half_width) if isinstance(half_width, tuple) else tuple(end * half_width for end in around)
    shown = ax.imshow(np.asarray(values), origin="lower", extent=extent, norm=norm, cmap=cmap, aspect="equal")
    ax.set_xlabel(text("θ_{x} [arcsec]"))
    if is_first:
        ax.set_ylabel(text("θ_{y} [arcsec]"))
    else:
        ax.tick_params(labelleft=False)
    ax.tick_params(which="both", color=ink(cmap)[0])
    return shown


def bar(figure: Any, shown: Any, axes: Any, label: str) -> Any:
    """A colour bar above panels, with arrows where values go on beyond its ends."""
    values, norm = finite(shown.get_array()), shown.norm
    below, above = (values < norm.vmin).any(), (values > norm.vmax).any()
    extend = {(False, False): "neither", (True, False): "min", (False, True): "max", (True, True): "both"}
    kind = extend[bool(below), bool(above)]
    found = figure.colorbar(shown, ax=axes, location="top", pad=0.02, aspect=40, fraction=0.05, extend=kind)
    found.set_label(text(label))
    _place_ticks(found, norm)
    found.ax.tick_params(which="both", direction="out", length=2.0)
    found.ax.tick_params(which="minor", length=1.2)
    return found


def _place_ticks(found: Any, norm: Any) -> None:
    """Numbers that do not meet: of an asinh stretch 0 and the decades beyond its softening, of a logarithmic one the decades."""
    from matplotlib.colors import AsinhNorm, LogNorm
    from matplotlib.ticker import FixedLocator, NullFormatter

    least, most = float(norm.vmin), float(norm.vmax)
    first = int(np.floor(np.log10(max(abs(most), 1e-300)))) - 12
    decades: Array = np.power(10.0, np.arange(first, 20, dtype=np.float64))
    if isinstance(norm, AsinhNorm):
        softening = float(norm.linear_width)
        shown = decades[(decades > 4.0 * softening) & (decades <= most)]
        between = np.outer(decades, np.arange(2, 10)).reshape(-1)
        found.set_ticks([0.0, *shown.tolist()])
        found.ax.xaxis.set_minor_locator(FixedLocator(between[(between > softening) & (between < most)].tolist()))
    elif isinstance(norm, LogNorm) and np.any((decades > least) & (decades < most)):
        found.ax.xaxis.set_minor_formatter(NullFormatter())


def caption(ax: Any, name: str, cmap: str, at: tuple[float, float] = (0.05, 0.93)) -> None:
    """A name inside a panel, with an outline."""
    from matplotlib import patheffects

    colour, halo = ink(cmap)
    outline = [patheffects.withStroke(linewidth=1.5, foreground=halo)]
    ax.text(*at, text(name), color=colour, transform=ax.transAxes, va="center", path_effects=outline)


def circle(ax: Any, radius: float, cmap: str) -> None:
    """The dashed Einstein circle; none for a radius that is not positive."""
    from matplotlib.patches import Circle

    if radius > 0.0:
        ax.add_patch(Circle((0.0, 0.0), radius, fill=False, ls="--", lw=0.8, ec=ink(cmap)[0]))


def outline(ax: Any, counts: Any, edges: Any, colour: str, label: str | None = None, width: float = 1.0) -> None:
    """A histogram: a line and a faint area."""
    if len(edges):
        area = ax.stairs(counts, edges, fill=True, color=colour, alpha=0.125, lw=0.0)
        area.set_zorder(1)
        ax.stairs(counts, edges, color=colour, lw=width, label=None if label is None else text(label), baseline=0)
