"""Figures of fits."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Union

import numpy as np

from .._drawing import corner as _corner
from .._drawing import density
from .._drawing.labels import symbol_of
from .._drawing.style import (
    BLACK,
    BLUE,
    COLUMN_MM,
    CYCLE,
    FLUX,
    GREY,
    ORANGE,
    PAGE_MM,
    RED,
    bar,
    caption,
    grid,
    image_norm,
    panels,
    raster,
    single,
    styled,
    text,
)
from .._errors import InputError
from .._fit import Fit
from .._haloray import read_groups
from .._read import Posterior, folder_file, read
from .._units import Array, mapping, names_in
from ._saved import half_of, json_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.colors import Normalize
    from matplotlib.figure import Figure, SubFigure

#: A fit, the draws of one, or the folder of one.
FitLike = Union[Fit, Posterior, str, "os.PathLike[str]"]


@styled
def reconstruction(fit: FitLike, figure: Figure | SubFigure | None = None) -> Any:
    """Draw data, model and (data − model)/σ.

    Parameters
    ----------
    fit : haloray.Fit or path
        A fit, or the folder of one.
    figure : matplotlib Figure or SubFigure, optional
        Where to draw.

    Returns
    -------
    matplotlib Figure or SubFigure
        What was drawn into.

    Raises
    ------
    InputError
        A quantity that the fit does not have; what is no fit.
    MissingFileError
        No such file.
    """
    from matplotlib.colors import Normalize

    if isinstance(fit, Fit):
        data, model, residual = fit.data_e_s, fit.model_e_s, fit.normalised_residuals
        scale, chi2 = fit.pixel_scale_arcsec, fit.statistics["chi2_reduced"]
    elif isinstance(fit, Posterior):
        raise InputError("a posterior.nc has no image: reconstruction takes a Fit or the folder of a fit")
    else:
        groups, _, attributes, _ = read_groups(folder_file(fit, "reconstruction.h5"))
        own = groups["image"]
        data, model, residual = own["data"], own["model"], own["residual"]
        scale, chi2 = attributes["image"]["pixel_scale_arcsec"], json_of(fit, "summary.json")["chi2_reduced"]
    norm, sigma = image_norm([data, model], _background(data - model, residual)), Normalize(-5.0, 5.0)
    half = half_of(data.shape[0], scale)
    rows: list[tuple[Array, str, Normalize, str]] = [
        (data, "data", norm, "inferno"),
        (model, "model", norm, "inferno"),
        (residual, f"χ^{{2}}/dof = {chi2:.3f}", sigma, "RdBu_r"),
    ]
    figure, axes = panels(figure, 1, 3, 1.0, extra_mm=9.0)
    shown: list[Any] = []
    for i, (values, name, colours, cmap) in enumerate(rows):
        shown.append(raster(axes[0, i], values, half, colours, cmap, i == 0))
        caption(axes[0, i], name, cmap)
    bar(figure, shown[0], list(axes[0, :2]), FLUX)
    bar(figure, shown[2], axes[0, 2], "(data − model)/σ")
    return figure


@styled
def source_plane(fit: Fit, ax: Axes | None = None) -> Axes:
    """Draw the first source of the best fit in its plane, out to four of its radii.

    Parameters
    ----------
    fit : haloray.Fit
        A fit whose source is a Sérsic profile.
    ax : matplotlib Axes, optional
        Where to draw.

    Returns
    -------
    matplotlib Axes
        What was drawn into.

    Raises
    ------
    InputError
        A fit without such a source.
    """
    own = fit.source
    if not own:
        raise InputError("the fit has no Sérsic source that could be drawn")
    n, radius = own["n_sersic"], own["R_sersic"]
    x0, y0, half = own["center_x"], own["center_y"], 4.0 * radius
    x, y = np.meshgrid(*(np.linspace(-half, half, 201),) * 2)
    size = np.hypot(own["e1"], own["e2"])
    q, angle = (1.0 - size) / (1.0 + size), 0.5 * np.arctan2(own["e2"], own["e1"])
    along, across = x * np.cos(angle) + y * np.sin(angle), -x * np.sin(angle) + y * np.cos(angle)
    r = np.sqrt(q * along**2 + across**2 / q)
    values = own["amplitude"] * np.exp(-(1.9992 * n - 0.3271) * ((r / radius) ** (1.0 / n) - 1.0))
    faintest = _background(fit.data_e_s - fit.model_e_s, fit.normalised_residuals) / fit.pixel_scale_arcsec**2
    axes = single(ax, 1.0)
    panel: Any = axes
    extent = (x0 - half, x0 + half, y0 - half, y0 + half)
    shown = raster(panel, values, extent, image_norm([values], faintest), "inferno")
    panel.set(xlabel=text("β_{x} [arcsec]"), ylabel=text("β_{y} [arcsec]"))
    bar(panel.figure, shown, panel, "source [e^{−} s^{−1} arcsec^{−2}]")
    return axes


def corner(
    fits: FitLike | Mapping[str, FitLike],
    names: Sequence[str] | None = None,
    figure: Figure | SubFigure | None = None,
    *,
    truths: Mapping[str, float] | None = None,
) -> Any:
    """Draw contours (68%, 95%) of every pair of quantities, every quantity on the diagonal with its 68% interval.

    Parameters
    ----------
    fits : haloray.Fit, haloray.Posterior, path, or a mapping of names to them
        What to lay over one another; a path is a posterior.nc or the folder of a fit.
    names : sequence of str, optional
        Which quantities; eight unless given, shears first.
    figure : matplotlib Figure or SubFigure, optional
        Where to draw.
    truths : mapping of str to float, optional
        Values that are known.

    Returns
    -------
    matplotlib Figure or SubFigure
        What was drawn into.

    Raises
    ------
    InputError
        A quantity that the fit does not have; what is no fit.
    MissingFileError
        No such file.
    """
    all_fits: Mapping[str, FitLike] = fits if isinstance(fits, Mapping) else {"": fits}
    draws = {name: _draws(fit) for name, fit in all_fits.items()}
    _check_truths(truths, [name for own in draws.values() for name in own])
    return _corner.corner(draws, names, figure, truths=truths)


@styled
def trace(
    fit: FitLike,
    names: Sequence[str] | None = None,
    figure: Figure | SubFigure | None = None,
    *,
    truths: Mapping[str, float] | None = None,
) -> Any:
    """Draw the draws of every chain in their order, and how each chain's ranks are spread (Vehtari et al. 2021).

    Parameters
    ----------
    fit, names, figure, truths
        See :func:`corner`; all quantities unless named.

    Returns
    -------
    matplotlib Figure or SubFigure
        What was drawn into.

    Raises
    ------
    InputError
        A quantity that the fit does not have; what is no fit.
    MissingFileError
        No such file.
    """
    draws = _draws(fit)
    _check_truths(truths, list(draws))
    chosen = list(draws) if names is None else names_in("names", names)
    unknown = [name for name in chosen if name not in draws]
    if unknown:
        raise InputError(f"{unknown[0]} is no quantity of the fit, which has {', '.join(draws)}")
    figure, axes = panels(figure, len(chosen), 2, 0.26, sharex="col")
    colours = (*CYCLE, RED, GREY, "#56b4e9")
    for (left, right), name in zip(axes, chosen):
        chains = np.atleast_2d(draws[name])
        shares = _rank_shares(chains)
        every = max(1, -(-len(chains) // 8))
        thin = max(1, -(-chains.shape[1] // 600))
        for i, chain in enumerate(range(0, len(chains), every)):
            colour = colours[i % len(colours)]
            left.plot(np.arange(chains.shape[1])[::thin], chains[chain, ::thin], lw=0.45, color=colour)
            right.stairs(
                shares[chain], np.linspace(0.0, 1.0, len(shares[chain]) + 1), color=colour, lw=0.8, baseline=None
            )
        if truths is not None and name in truths:
            left.axhline(truths[name], ls="--", lw=0.8, color=BLACK)
        right.axhline(1.0, ls="--", lw=0.6, color=GREY)
        left.set(ylabel=text(symbol_of(name)), xlim=(0, chains.shape[1]))
        right.set(ylabel="share", xlim=(0.0, 1.0), ylim=(0.0, max(2.0, float(shares.max()))))
    axes[-1, 0].set_xlabel("draw")
    axes[-1, 1].set_xlabel("rank of draw")
    return figure


@styled
def profiles(
    fit: FitLike, figure: Figure | SubFigure | None = None, *, truths: Mapping[str, float] | None = None
) -> Any:
    """Draw profile likelihoods beside the posterior's densities, with the levels of the intervals of 68% and 95%.

    Parameters
    ----------
    fit : haloray.Fit or path
        A fit with profile likelihoods, or the folder of one (``haloray fit --profile``).
    figure : matplotlib Figure or SubFigure, optional
        Where to draw.
    truths : mapping of str to float, optional
        Values that are known.

    Returns
    -------
    matplotlib Figure or SubFigure
        What was drawn into.

    Raises
    ------
    InputError
        A fit without profile likelihoods; a quantity that it does not have; what is no fit.
    MissingFileError
        No such file.
    """
    if isinstance(fit, Posterior):
        raise InputError("a posterior.nc has no profile likelihoods: profiles takes a Fit or the folder of a fit")
    draws = _draws(fit)
    _check_truths(truths, list(draws))
    statistics: dict[str, Any] = fit.statistics if isinstance(fit, Fit) else json_of(fit, "summary.json")
    found: list[dict[str, Any]] = statistics.get("profiles", [])
    if not found:
        raise InputError("the fit has no profile likelihoods: name the parameters that they are wanted of (profile)")
    width = COLUMN_MM if len(found) == 1 else PAGE_MM
    figure, axes = grid(figure, len(found), min(len(found), 3), 0.87, width, sharey=True)
    for i, (ax, own) in enumerate(zip(axes, found)):
        name, unit = own["name"], own["unit"]
        for level in np.exp([-0.5, -2.0]):
            ax.axhline(level, ls="--", lw=0.6, color=GREY)
        ax.plot(*_likelihood_ratio(own), lw=1.2, color=ORANGE, label="profile likelihood")
        ax.plot(*(density.curve(draws[name]) or ([], [])), lw=1.2, color=BLUE, label="posterior")
        if truths is not None and name in truths:
            ax.axvline(truths[name], ls="--", lw=0.8, color=BLACK, label="truth")
        ax.set(xlabel=text(symbol_of(name) + (f" [{unit}]" if unit else "")), ylim=(0.0, 1.35))
        if i % 3 == 0:
            ax.set_ylabel("relative to the highest")
        ax.legend(loc="upper right")
    return figure


def _likelihood_ratio(profile: dict[str, Any]) -> tuple[Array, Array]:
    """Values and L/L_max on a fine grid: √(−2Δln L), with the sign of the side, is interpolated linearly."""
    values = np.asarray(profile["values"], dtype=np.float64)
    root = np.sqrt(np.maximum(-2.0 * np.asarray(profile["delta_log_likelihood"], dtype=np.float64), 0.0))
    root = np.where(values < profile["best_fit"], -root, root)
    nodes = np.arange(len(values))
    places = np.linspace(0.0, len(values) - 1, 12 * (len(values) - 1) + 1)
    return np.interp(places, nodes, values), np.exp(-0.5 * np.interp(places, nodes, root) ** 2)


def _check_truths(truths: Any, known: list[str]) -> None:
    for name in () if truths is None else mapping("truths", truths, "values by name"):
        if name not in known:
            raise InputError(f"{name} of truths is no quantity of the fit, which has {', '.join(dict.fromkeys(known))}")


def _draws(fit: FitLike) -> dict[str, Array]:
    if isinstance(fit, (Fit, Posterior)):
        return fit.posterior
    found = read(folder_file(fit, "posterior.nc"))
    if not isinstance(found, Posterior):
        raise InputError(f"{fit} is no posterior")
    return found.posterior


def _background(difference: Array, residual: Array) -> float:
    """The smallest noise of a pixel."""
    with np.errstate(divide="ignore", invalid="ignore"):
        sigma = np.abs(difference / residual)
    sigma = sigma[np.isfinite(sigma) & (sigma > 0.0)]
    return float(sigma.min()) if len(sigma) else 0.0


def _rank_shares(chains: Array, bins: int = 20) -> Array:
    """Per chain, the share of its draws in each bin of the ranks among all draws, times the number of bins."""
    order = np.argsort(chains, axis=None, kind="stable")
    place = np.arange(order.size) * bins // order.size
    shares = np.zeros((len(chains), bins))
    np.add.at(shares, (order // chains.shape[1], place), bins / chains.shape[1])
    return shares
