"""Figures of the haloes of a run."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from .._drawing.style import BLACK, BLUE, GREEN, RED, WHITE, finite, outline, panels, quantile, single, styled, text
from .._units import Array
from ._saved import RunLike, group_of, run_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure, SubFigure

ARCSEC_RAD = np.pi / 648_000.0
BINS_PER_DECADE = 8.0


@styled
def mass_function(run: RunLike, ax: Axes | None = None) -> Axes:
    """Draw the halo mass function of a run, and its haloes as points with Poisson errors.

    Parameters
    ----------
    run : path or Run
        A run's folder or file, or :func:`haloray.read` of it.
    ax : matplotlib Axes, optional
        Where to draw.

    Returns
    -------
    matplotlib Axes
        What was drawn into.

    Raises
    ------
    InputError
        What is no run, or one without what is drawn.
    MissingFileError
        No such file.
    """
    own = run_of(run)
    group, about = group_of(own, "mass_function"), own.attributes.get("mass_function", {})
    axes = single(ax, 0.8)
    panel: Any = axes
    name = f"{about.get('name', '')}, z = {about.get('z', float('nan')):g}"
    panel.plot(group["m200c_msun"], group["dn_dlnm_per_cmpc3"], color=BLUE, lw=1.1, label=name)
    if "drawn" in group:
        edges, counts = group["drawn"]["m200c_edges_msun"], group["drawn"]["counts"]
        per_count = 1.0 / (group["drawn"]["kept_volume_cmpc3"] * np.diff(np.log(edges)))
        full = counts > 0
        middle = np.sqrt(edges[1:] * edges[:-1])[full]
        n, unit = counts[full], per_count[full]
        panel.errorbar(
            middle,
            n * unit,
            np.sqrt(n) * unit,
            fmt="o",
            ms=3.0,
            color=BLACK,
            elinewidth=0.7,
            label="haloes of this run",
        )
    panel.set(xscale="log", yscale="log", xlabel=text("M_{200c} [M_{⊙}]"), ylabel=text("dn/dlnM [Mpc^{−3}]"))
    panel.legend(loc="lower left")
    return axes


@styled
def cylinder(run: RunLike, ax: Axes | None = None, *, stride: int = 10) -> Axes:
    """Draw where the haloes lie along the line of sight, those beyond the tidal regime in red.

    Parameters
    ----------
    run : path or Run
        A run's folder or file, or :func:`haloray.read` of it.
    ax : matplotlib Axes, optional
        Where to draw.
    stride : int
        Of the haloes in the tidal regime every so manyth is drawn.

    Returns
    -------
    matplotlib Axes
        What was drawn into.

    Raises
    ------
    InputError
        What is no run, or one without what is drawn.
    MissingFileError
        No such file.
    """
    from matplotlib import patheffects

    own = run_of(run)
    haloes, distances = group_of(own, "haloes"), group_of(own, "distances")
    about, threshold = own.attributes["distances"], own.setting("diagnostics", "delta_threshold")
    chi = haloes["chi_cmpc"]
    y = chi * haloes["theta_y_arcsec"] * ARCSEC_RAD
    rough = haloes["delta_h"] >= threshold
    axes = single(ax, 0.42, 174.0)
    panel: Any = axes
    share = "" if stride == 1 else f" (1 in {stride} shown)"
    options: dict[str, Any] = {"ls": "", "marker": "o", "mew": 0.0}
    smooth = np.flatnonzero(~rough)[::stride]
    panel.plot(chi[smooth], y[smooth], ms=1.1, color=BLUE, label=text(f"Δ_{{h}} < {threshold:g}{share}"), **options)
    panel.plot(chi[rough], y[rough], ms=1.5, color=RED, label=text(f"Δ_{{h}} ≥ {threshold:g}"), **options)
    for place, name, side in ((about["lens_cmpc"], " lens", "left"), (about["source_cmpc"], "source ", "right")):
        panel.axvline(place, ls="--", lw=0.9, color=BLACK)
        halo = [patheffects.withStroke(linewidth=1.5, foreground=WHITE)]
        panel.text(place, 0.06, name, ha=side, va="center", transform=panel.get_xaxis_transform(), path_effects=halo)
    panel.set_xlim(0.0, 1.03 * max(float(np.max(chi, initial=0.0)), about["source_cmpc"]))
    if half := quantile(np.abs(y), 1.0):
        panel.set_ylim(-1.4 * half, 1.4 * half)
    panel.set(xlabel="comoving distance χ along the line of sight [Mpc]", ylabel=text("comoving y = χ θ_{y} [Mpc]"))
    panel.tick_params(which="both", top=False)
    z: Array = distances["z"]
    known: Array = distances["chi_cmpc"]

    def redshift_at(own: Array) -> Array:
        return np.asarray(np.interp(own, known, z), dtype=np.float64)

    def distance_at(own: Array) -> Array:
        return np.asarray(np.interp(own, z, known), dtype=np.float64)

    top = panel.secondary_xaxis("top", functions=(redshift_at, distance_at))
    top.set_xlabel("redshift")
    panel.legend(loc="upper left", markerscale=2.0)
    return axes


@styled
def histograms(run: RunLike, figure: Figure | SubFigure | None = None) -> Any:
    """Draw how strongly single haloes act: κ_h, \\|γ_h\\| and Δ_h on the axis, the last also over a disc.

    Parameters
    ----------
    run : path or Run
        A run's folder or file, or :func:`haloray.read` of it.
    figure : matplotlib Figure or SubFigure, optional
        Where to draw.

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
    own = run_of(run)
    haloes, threshold = group_of(own, "haloes"), own.setting("diagnostics", "delta_threshold")
    shear = np.hypot(haloes["gamma1_h"], haloes["gamma2_h"])
    figure, axes = panels(figure, 1, 3, 0.9, sharey=True)
    tallest = 1.0
    for i, (values, label, colour) in enumerate(
        [(haloes["kappa_h"], "κ_{h}", BLUE), (shear, "|γ_{h}|", GREEN), (haloes["delta_h"], "Δ_{h}", RED)]
    ):
        counts, edges = _log_bins(values)
        tallest = max(tallest, *counts)
        outline(axes[0, i], counts, edges, colour, "at two points" if i == 2 else None, 0.9)
        axes[0, i].set(xscale="log", yscale="log", xlabel=text(label))
    last = axes[0, 2]
    outline(last, *_log_bins(haloes["delta_disc_h"]), BLACK, "over a disc", 0.6)
    last.axvline(threshold, ls="--", lw=0.9, color=BLACK, label=text(f"Δ_{{h}} = {threshold:g}"))
    last.legend(loc="upper left")
    axes[0, 0].set(ylabel="haloes per 0.125 dex", ylim=(0.5, 100.0 * tallest))
    return figure


def _log_bins(values: Any) -> tuple[Any, Any]:
    """Counts and edges of logarithmic bins that take in every positive finite value."""
    positive = finite(values)
    places = np.floor(np.log10(positive[positive > 0.0]) * BINS_PER_DECADE).astype(int)
    if not len(places):
        return np.zeros(0), np.zeros(0)
    first = places.min()
    counts = np.bincount(places - first)
    return counts, 10.0 ** ((first + np.arange(len(counts) + 1)) / BINS_PER_DECADE)
