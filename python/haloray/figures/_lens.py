"""Critical curves and caustics."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from .._drawing.style import BLACK, BLUE, ORANGE, panels, styled, text
from .._lens_results import CriticalCurve, PointImages
from .._read import Run
from .._units import Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure, SubFigure


class Curve(NamedTuple):
    """A critical curve and its caustic, each of shape (n, 2) and closed where it is."""

    tangential: bool
    critical: Array
    caustic: Array


@styled
def curves(
    curves: Sequence[CriticalCurve],
    images: PointImages | None = None,
    source_arcsec: tuple[float, float] | None = None,
    figure: Figure | SubFigure | None = None,
    *,
    half_width_arcsec: float | None = None,
) -> Any:
    """Draw critical curves with the images of a source on the left, caustics with the source on the right.

    Parameters
    ----------
    curves : sequence of CriticalCurve
        Of :meth:`haloray.LensModel.critical_curves`.
    images : PointImages, optional
        Of :meth:`haloray.LensModel.point_source_images`.
    source_arcsec : tuple of float, optional
        The place of the source.
    figure : matplotlib Figure or SubFigure, optional
        Where to draw.
    half_width_arcsec : float, optional
        Half the width of the left panel.

    Returns
    -------
    matplotlib Figure or SubFigure
        What was drawn into.

    Raises
    ------
    AttributeError
        What are no curves or images of haloray.
    """
    found = [_of(curve) for curve in curves]
    reach = max((float(np.abs(own).max()) for _, own, _ in found), default=1.0)
    half = 1.3 * reach if half_width_arcsec is None else half_width_arcsec
    caustic = [np.abs(own).max() for _, _, own in found] + [np.abs(source_arcsec).max() if source_arcsec else 0.0]
    inner = 1.45 * min(float(max(caustic)), half) or half
    figure, axes = panels(figure, 1, 2, 1.0)
    for i, (ax, symbol, width) in enumerate([(axes[0, 0], "θ", half), (axes[0, 1], "β", inner)]):
        named: set[str] = set()
        for own in found:
            kind = "tangential" if own.tangential else "radial"
            name = None if kind in named else kind
            named.add(kind)
            colour, style = (BLUE, "-") if own.tangential else (ORANGE, "--")
            ax.plot(*(own.caustic if i else own.critical).T, color=colour, ls=style, lw=0.9, label=name)
        labels = {f"{axis}label": text(f"{symbol}_{{{axis}}} [arcsec]") for axis in "xy"}
        ax.set(xlim=(-width, width), ylim=(-width, width), aspect="equal", **labels)
    if images is not None:
        axes[0, 0].plot(*images.theta_arcsec.T, "o", ms=4.4, mew=0, color=BLACK, label="images")
    if source_arcsec is not None:
        axes[0, 1].plot(*source_arcsec, "o", ms=4.4, mew=0, color=BLACK, label="source")
    for ax in axes.flat:
        if ax.get_legend_handles_labels()[0]:
            ax.legend(loc="upper right")
    return figure


@styled
def overlay(curves: Sequence[CriticalCurve], ax: Axes, colour: str = "white") -> Axes:
    """Draw critical curves and, finer, caustics over an image or a map; tangential ones solid, radial ones dashed.

    Parameters
    ----------
    curves : sequence of CriticalCurve
        Of :meth:`haloray.LensModel.critical_curves`.
    ax : matplotlib Axes
        Where to draw; its limits stay.
    colour : str
        Of the lines.

    Returns
    -------
    matplotlib Axes
        What was drawn into.

    Raises
    ------
    AttributeError
        What are no curves of haloray.
    """
    lay_over(ax, [_of(curve) for curve in curves], colour)
    return ax


def lay_over(ax: Any, found: Sequence[Curve], colour: str) -> None:
    """Curves over a panel, whose limits stay."""
    limits = ax.get_xlim(), ax.get_ylim()
    for tangential, critical, caustic in found:
        style = "-" if tangential else "--"
        ax.plot(*critical.T, color=colour, lw=0.9, ls=style)
        ax.plot(*caustic.T, color=colour, lw=0.5, ls=style)
    ax.set(xlim=limits[0], ylim=limits[1])


def _of(curve: CriticalCurve) -> Curve:
    critical: Array = np.asarray(curve.theta_arcsec)
    caustic: Array = np.asarray(curve.beta_arcsec)
    if curve.closed:
        critical, caustic = (np.concatenate([own, own[:1]]) for own in (critical, caustic))
    return Curve(curve.kind == "tangential", critical, caustic)


def curves_of_group(run: Run, group: str) -> list[Curve]:
    """The critical curves saved in a group of a run, caustics about the source; none where there are none."""
    own: Any = run.groups
    for part in group.split("/"):
        own = own.get(part, {})
    if "curve" not in own:
        return []
    about = run.attributes.get(group, {})
    source = np.array([about.get("source_x_arcsec", 0.0), about.get("source_y_arcsec", 0.0)])
    found: list[Curve] = []
    for number in np.unique(own["curve"]):
        rows = np.flatnonzero(own["curve"] == number)
        if own["closed"][rows[0]]:
            rows = np.append(rows, rows[0])
        critical = np.stack([own["theta_x_arcsec"][rows], own["theta_y_arcsec"][rows]], axis=1)
        caustic = np.stack([own["beta_x_arcsec"][rows], own["beta_y_arcsec"][rows]], axis=1) - source
        found.append(Curve(own["kind"][rows[0]] == "tangential", critical, caustic))
    return found
