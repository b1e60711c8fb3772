"""Figures of the study of validity: its first case, fitted from its first start."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from .._drawing.style import (
    BLACK,
    BLUE,
    CYCLE,
    GREY,
    ORANGE,
    finite,
    grid,
    outline,
    panels,
    single,
    steps,
    styled,
    text,
)
from .._errors import InputError
from .._units import Array
from ._saved import columns_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure, SubFigure

DEFINITIONS = ("axis", "ring", "light", "best_tidal", "best_flexion")
#: Smallest p of a fit that describes its image, χ² above the tidal twin's that is noticed, ln of a ratio of evidences that decides.
GOOD_P, NOTICED_EXCESS, PREFERRED_LOG_ODDS = 1e-3, 25.0, 5.0


@styled
def validity_fitted_shears(table: Any, figure: Figure | SubFigure | None = None, *, threshold: float = 0.1) -> Any:
    """Draw the fitted shears against three definitions of γ_LOS: along the axis, along the ring, of the nearest tidal model.

    Parameters
    ----------
    table : path, mapping or DataFrame
        The folder of ``haloray study validity``, its validity.csv, or its columns.
    figure : matplotlib Figure or SubFigure, optional
        Where to draw.
    threshold : float
        The limit of Δ_h whose fits stand below those of the first view: the study's ``diagnostics.delta_threshold``.

    Returns
    -------
    matplotlib Figure or SubFigure
        What was drawn into.

    Raises
    ------
    OSError
        No such file.
    KeyError
        A table without the columns that are drawn.
    """
    own, views, models = _first(table)
    shown = [view for i, view in enumerate(views) if i == 0 or _limit(view) == threshold]
    figure, axes = panels(figure, len(shown), 3, 1.0)
    for row, view in zip(axes, shown):
        fits = _fits(own, view, models[0])
        is_good = np.tile(fits["p_value"] >= GOOD_P, 2)
        fitted, sigma = _both(fits, "gamma{}_los_fit"), np.sqrt(_both(fits, "covariance_{0}{0}"))
        for ax, definition in zip(row, ("axis", "ring", "best_tidal")):
            defined = _both(fits, "gamma{}_los_" + definition)
            sizes = np.sort(np.abs(finite([defined, fitted])))
            # A few fits far out must not hide all others.
            reach = 1.3 * max(0.01, sizes[len(sizes) * 49 // 50] if len(sizes) else 0.05)
            ax.plot([-reach, reach], [-reach, reach], ls="--", lw=0.8, color=GREY)
            for chosen, colour, label in ((~is_good, ORANGE, "p < 0.001"), (is_good, BLUE, "p ≥ 0.001")):
                x, y, errors = defined[chosen], fitted[chosen], sigma[chosen]
                ax.errorbar(x, y, errors, fmt="o", ms=3, mew=0, elinewidth=0.7, color=colour, label=label)
            ax.set(xlim=(-reach, reach), ylim=(-reach, reach), ylabel=text("fitted γ_{1,2}^{LOS}"))
            ax.set_xlabel(text(f"γ_{{1,2}} of {_plain(definition)}"))
            _title(ax, view)
            ax.legend(loc="upper left")
    return figure


@styled
def validity_coverage(table: Any, figure: Figure | SubFigure | None = None) -> Any:
    """Draw the fraction of fits within so many σ of each definition of γ_LOS, beside what right errors give, 1 − exp(−σ²).

    Parameters
    ----------
    table, figure
        See :func:`validity_fitted_shears`.

    Returns
    -------
    matplotlib Figure or SubFigure
        What was drawn into.

    Raises
    ------
    OSError
        No such file.
    KeyError
        A table without the columns that are drawn.
    """
    own, views, models = _first(table)
    figure, axes = grid(figure, len(views), 2, 0.75)
    right = np.geomspace(0.1, 100.0, 121)
    for ax, view in zip(axes, views):
        fits = _fits(own, view, models[0])
        for definition, colour in zip(DEFINITIONS, CYCLE):
            ax.plot(*steps(_sigmas(fits, definition)), color=colour, label=_plain(definition))
        # Of a twin all definitions are one.
        twins = _fits(own, view, models[0], "tidal")
        ax.plot(*steps(_sigmas(twins, "best_tidal")), color=GREY, label="tidal twins")
        ax.plot(right, 1.0 - np.exp(-(right**2)), ls="--", lw=0.8, color=BLACK, label="right errors")
        ax.set(xscale="log", xlim=(0.1, 100.0), ylim=(0.0, 1.0))
        ax.set(xlabel="deviation from the definition [σ]", ylabel="fraction of fits")
        _title(ax, view)
        ax.legend(loc="lower right")
    return figure


@styled
def validity_excess(table: Any, figure: Figure | SubFigure | None = None) -> Any:
    """Draw χ² above that of the tidal twins, 0.1 where it is less, against Δ_tot and the residual of the nearest tidal model.

    Parameters
    ----------
    table, figure
        See :func:`validity_fitted_shears`.

    Returns
    -------
    matplotlib Figure or SubFigure
        What was drawn into.

    Raises
    ------
    OSError
        No such file.
    KeyError
        A table without the columns that are drawn.
    """
    own, views, models = _first(table)
    labels = {
        "delta_tot": "Δ_{tot}",
        "delta_tot_ring": "Δ_{tot}, ring",
        "residual_best_tidal_arcsec": "residual of best tidal [arcsec]",
    }
    figure, axes = panels(figure, 1, 3, 1.13, sharey=True)
    for ax, (name, label) in zip(axes[0], labels.items()):
        for i, view in enumerate(views):
            fits = _fits(own, view, models[0])
            excess = np.maximum(fits["chi2_excess"], 0.1)
            ax.plot(fits[name], excess, "o", ms=2.2, mew=0, alpha=0.6, color=CYCLE[i % 5], label=text(_words(view)))
        ax.axhline(NOTICED_EXCESS, ls="--", lw=0.8, color=GREY)
        ax.set(xscale="log", yscale="log", xlabel=text(label))
        ax.legend(loc="upper left")
    axes[0, 0].set_ylabel("χ² − χ² of the tidal twin")
    return figure


@styled
def validity_failing(table: Any, ax: Axes | None = None) -> Axes:
    """Draw how many sightlines fail when haloes up to which Δ_h are seen; those of all haloes stand at the right.

    Parameters
    ----------
    table
        See :func:`validity_fitted_shears`.
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
    own, views, models = _first(table)
    limits = np.array([_limit(view) for view in views])
    limited = limits[np.isfinite(limits)]
    all_at = 4.0 * limited.max() if len(limited) else 1.0
    limits[np.isinf(limits)] = all_at
    first = [_fits(own, view, models[0]) for view in views]
    curves = {
        f"{models[0]}: p < 0.001": [fits["p_value"] < GOOD_P for fits in first],
        f"{models[0]}: χ² above the twin's by 25": [fits["chi2_excess"] > NOTICED_EXCESS for fits in first],
    }
    if len(models) > 1:
        second = [_fits(own, view, models[1]) for view in views]
        curves[f"{models[1]}: p < 0.001"] = [fits["p_value"] < GOOD_P for fits in second]
        curves[f"{models[1]} preferred by evidence"] = [
            _log_odds(fits, before) > PREFERRED_LOG_ODDS for fits, before in zip(second, first)
        ]
    axes = single(ax, 0.9)
    panel: Any = axes
    order = np.argsort(limits)
    for i, (name, fails) in enumerate(curves.items()):
        part, error = 100.0 * np.array([_share(fails[view]) for view in order]).T
        # Beside each other, so that errors can be told apart.
        places, colour = limits[order] * (1.0 + 0.02 * i), CYCLE[i]
        panel.plot(places, part, lw=0.9, color=colour, label=name)
        panel.errorbar(places, part, error, fmt="o", ms=3, mew=0, elinewidth=0.7, color=colour)
    panel.set(xscale="log", ylim=(0.0, 130.0), ylabel="sightlines [%]")
    panel.set_xlabel(text(f"haloes seen: Δ_{{h}} below (all at {all_at:g})"))
    panel.set_xticks(limits, [f"{limit:g}" for limit in limits])
    panel.tick_params(axis="x", which="minor", labelbottom=False)
    panel.legend(loc="upper left")
    return axes


@styled
def validity_delays(table: Any, figure: Figure | SubFigure | None = None) -> Any:
    """Draw how H0 from the delays, over the true one, is distributed: by tensors of the axis, of the ring, of the best fit.

    Parameters
    ----------
    table, figure
        See :func:`validity_fitted_shears`.

    Returns
    -------
    matplotlib Figure or SubFigure
        What was drawn into.

    Raises
    ------
    InputError
        A study without delays.
    OSError
        No such file.
    KeyError
        A table without the columns that are drawn.
    """
    names = {
        "h0_ratio_axis": "tensors of the axis",
        "h0_ratio_ring": "tensors of the ring",
        "h0_ratio_fit": "best fit",
    }
    own, views, models = _first(table)
    if not np.isfinite(own["h0_ratio_axis"]).any():
        raise InputError("the study was made without delays, and has no H0")
    figure, axes = grid(figure, len(views), 2, 0.7)
    for ax, view in zip(axes, views):
        fits, bins, tallest = _fits(own, view, models[0]), 40, 1.0
        sizes = np.sort(finite([np.abs(fits[name] - 1.0) for name in names]))
        reach = max(1e-3, sizes[len(sizes) * 9 // 10] if len(sizes) else 0.1)
        edges = 1.0 + reach * np.linspace(-1.0, 1.0, bins + 1)
        for (name, label), colour in zip(names.items(), CYCLE):
            places = (finite(fits[name]) - 1.0 + reach) / (2.0 * reach) * bins
            counts = np.bincount(places[(places >= 0.0) & (places < bins)].astype(int), minlength=bins)
            tallest = max(tallest, float(counts.max()))
            outline(ax, counts, edges, colour, label)
        ax.set(xlabel=text("H_{0} / true H_{0}"), ylabel="sightlines", ylim=(0.0, 1.5 * tallest))
        _title(ax, view)
        ax.legend(loc="upper left")
    return figure


@styled
def validity_haloes(table: Any, ax: Axes | None = None) -> Axes:
    """Draw redshift and mass of the halo whose shear changes most, of images of all haloes that look tidal and of others.

    Parameters
    ----------
    table
        See :func:`validity_fitted_shears`.
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
    own, _, models = _first(table)
    fits = _fits(own, "all", models[0])
    z, mass = fits["halo_z"], fits["halo_m200c_msun"]
    is_noticed = fits["chi2_excess"] > NOTICED_EXCESS
    axes = single(ax, 0.8)
    panel: Any = axes
    for chosen, colour, label in (
        (~is_noticed, BLUE, "χ² as of the tidal twin"),
        (is_noticed, ORANGE, "χ² above it by 25"),
    ):
        panel.plot(z[chosen], mass[chosen], "o", ms=2.8, mew=0, alpha=0.7, color=colour, label=label)
    panel.set(yscale="log", xlabel="z", ylabel=text("M_{200c} [M_{⊙}]"))
    if len(finite(mass)):
        # Room for the legend.
        panel.set_ylim(0.7 * np.nanmin(mass), 8.0 * np.nanmax(mass))
    panel.legend(loc="upper right")
    return axes


def _first(table: Any) -> tuple[dict[str, Any], list[Any], list[str]]:
    """The columns of the first case from the first start, which haloes are seen, and the models."""
    own = columns_of(table, "validity.csv")
    rows = (own["case"] == own["case"][0]) & (own["start"] == own["start"][0])
    first = {name: values[rows] for name, values in own.items()}
    views, models = (list(dict.fromkeys(first[name].tolist())) for name in ("haloes", "model"))
    return first, views, models


def _fits(own: dict[str, Any], view: Any, model: str, mock: str = "haloes") -> dict[str, Any]:
    """The fits of one kind that came to something."""
    rows = (own["haloes"] == view) & (own["model"] == model) & (own["mock"] == mock) & np.isfinite(own["chi2"])
    return {name: values[rows] for name, values in own.items()}


def _limit(view: Any) -> float:
    """The Δ_h below which haloes are seen."""
    return np.inf if view == "all" else float(view)


def _words(view: Any) -> str:
    return "all" if view == "all" else f"Δ_{{h}} < {_limit(view):g}"


def _title(ax: Any, view: Any) -> None:
    ax.set_title(text(f"seen: {_words(view)}"), fontsize=7, loc="left", pad=3)


def _plain(definition: str) -> str:
    return definition.replace("_", " ")


def _both(fits: dict[str, Any], name: str) -> Array:
    """Both components of a quantity, one after the other."""
    return np.concatenate([fits[name.format(i)] for i in (1, 2)])


def _sigmas(fits: dict[str, Any], definition: str) -> Array:
    """√(dᵀC⁻¹d/2) of the fitted γ_LOS: 1 for a deviation of one σ in each component."""
    d1, d2 = (fits[f"gamma{i}_los_fit"] - fits[f"gamma{i}_los_{definition}"] for i in (1, 2))
    c11, c12, c22 = (fits[f"covariance_{ij}"] for ij in ("11", "12", "22"))
    with np.errstate(divide="ignore", invalid="ignore"):
        squared = (c22 * d1**2 - 2.0 * c12 * d1 * d2 + c11 * d2**2) / (c11 * c22 - c12**2)
        return np.sqrt(0.5 * squared)  # type: ignore[no-any-return]


def _log_odds(fits: dict[str, Any], first: dict[str, Any]) -> Array:
    """ln of the evidences over those of the first model."""
    evidences = dict(zip(first["sightline"].tolist(), first["log_evidence"].tolist()))
    of_first = [evidences.get(sightline, np.nan) for sightline in fits["sightline"].tolist()]
    return fits["log_evidence"] - np.array(of_first)  # type: ignore[no-any-return]


def _share(fails: Array) -> tuple[float, float]:
    """The part of the sightlines that fail and its error √(p(1 − p)/n), p being a case off zero and one."""
    hits, n = np.count_nonzero(fails), len(fails)
    if n == 0:
        return np.nan, np.nan
    p = (hits + 1.0) / (n + 2.0)
    return hits / n, float(np.sqrt(p * (1.0 - p) / n))
