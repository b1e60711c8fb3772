"""Figures of studies, from the tables that they leave."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from .._drawing.labels import symbol_of
from .._drawing.style import (
    BLACK,
    BLUE,
    CYCLE,
    GREY,
    ORANGE,
    RED,
    bar,
    circle,
    finite,
    log_norm,
    outline,
    panels,
    raster,
    single,
    steps,
    styled,
    symmetric,
    text,
)
from .._read import folder_file
from .._units import Array
from ._saved import columns_of, group_of, half_of, json_of, run_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure, SubFigure

RESIDUAL = "|γ_{LOS}^{out} − γ_{LOS}^{in}| / σ"


@styled
def deviations(table: Any, ax: Axes | None = None) -> Axes:
    """Draw the fraction of fits within so many σ of each definition of γ_LOS.

    Parameters
    ----------
    table : path, mapping or DataFrame
        The folder of ``haloray study which-shear``, its which_shear.csv, or its columns ``deviation_…``.
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
    own = columns_of(table, "which_shear.csv")
    axes = single(ax, 0.6, 174.0)
    panel: Any = axes
    names = [name for name in own if name.startswith("deviation_")]
    for i, name in enumerate(names):
        panel.plot(*steps(own[name]), color=CYCLE[i % 5], label=_plain(name))
    panel.set(xscale="log", ylim=(0.0, 1.0), xlabel="deviation from the definition [σ]", ylabel="fraction of fits")
    panel.legend(loc="upper left")
    return axes


def _plain(name: str) -> str:
    return name.removeprefix("deviation_").removesuffix("_sigma").replace("_", " ")


@styled
def tidal_residuals(study: Any, figure: Figure | SubFigure | None = None) -> Any:
    """Draw what the tidal and flexion models leave: of the rays and the image of one sightline, and of all sightlines.

    Parameters
    ----------
    study : path
        The folder of ``haloray study tidal``.
    figure : matplotlib Figure or SubFigure, optional
        Where to draw.

    Returns
    -------
    matplotlib Figure or SubFigure
        What was drawn into.

    Raises
    ------
    OSError
        No such file.
    """
    own, maps = columns_of(study, "residuals.csv"), run_of(folder_file(study, "residual_maps.h5"))
    rays, image = group_of(maps, "rays"), group_of(maps, "image")
    node, radius = (maps.attributes["rays"][name] for name in ("half_width_arcsec", "einstein_radius_arcsec"))
    models = ("tidal", "flexion")
    n, norm = len(rays["tidal_arcsec"]), log_norm([rays[f"{model}_arcsec"] for model in models], 0.99)
    pixels = half_of(len(image["tidal_over_noise"]), maps.attributes["image"]["pixel_scale_arcsec"])
    figure, axes = panels(figure, 2, 3, 1.0, extra_mm=18.0)
    for i, model in enumerate(models):
        shown = raster(axes[0, i], rays[f"{model}_arcsec"], node * n / (n - 1), norm, "magma", i == 0)
        bar(figure, shown, axes[0, i], f"|β − β_{{{model}}}| [arcsec]")
        circle(axes[0, i], radius, "magma")
        # In a stretch of its own: the two differ by orders of magnitude.
        values = image[f"{model}_over_noise"]
        shown = raster(axes[1, i], values, pixels, symmetric(values), "RdBu_r", i == 0)
        bar(figure, shown, axes[1, i], f"(image − image_{{{model}}})/σ")
    for ax, name, what, unit in (
        (axes[0, 2], "{}_rms_arcsec", "rms", " [arcsec]"),
        (axes[1, 2], "{}_image_chi2", "image χ^{2}", ""),
    ):
        tidal, flexion = (own[name.format(model)] for model in models)
        both = finite([tidal, flexion])
        ends = [both[both > 0.0].min(), both.max()]
        ax.plot(ends, ends, ls="--", lw=0.8, color=BLACK, label="equal")
        ax.plot(tidal, flexion, ls="", marker="o", ms=2.4, mew=0, alpha=0.8, color=BLUE, label="one cone each")
        ax.set(xscale="log", yscale="log", xlabel=text(f"{what}, tidal{unit}"), ylabel=text(f"{what}, flexion{unit}"))
        ax.legend(loc="upper left")
    return figure


@styled
def cut(table: Any, figure: Figure | SubFigure | None = None) -> Any:
    """Draw what the shear cut changes, against the loosest cut of the study.

    Parameters
    ----------
    table : path, mapping or DataFrame
        The folder of ``haloray study cut``, its cut.csv, or its columns.
    figure : matplotlib Figure or SubFigure, optional
        Where to draw.

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
    own = columns_of(table, "cut.csv")
    cuts = own["min_point_shear"]

    def change(*names: str) -> Array:
        return np.sqrt(sum((own[name] - own[name][-1]) ** 2 for name in names))  # type: ignore[no-any-return]

    left = [
        (change("kappa_os"), "κ", BLACK, "-"),
        (change("gamma1_os", "gamma2_os"), "γ", BLUE, "-"),
        (change("F1_os_per_arcsec", "F2_os_per_arcsec"), "F [arcsec^{−1}]", ORANGE, "-"),
        (change("delta_tot"), "Δ", BLACK, "--"),
    ]
    right = [
        (own["image_max_over_noise"], "largest pixel", BLUE, "-"),
        (own["image_chi2"], "χ^{2}", ORANGE, "-"),
    ]
    figure, axes = panels(figure, 1, 2, 0.75)
    labels = ("change from the loosest cut", "change of the image over its noise")
    for ax, curves, label, room in zip(axes[0], (left, right), labels, (100.0, 20.0)):
        shown = [value for values, *_ in curves for value in values if value > 0.0]
        for values, name, colour, style in curves:
            keep = (values > 0.0) & (cuts > 0.0)
            ax.plot(cuts[keep], values[keep], color=colour, ls=style, label=text(name))
        ax.set(xscale="log", yscale="log", xlabel="smallest point-lens shear kept", ylabel=label)
        if shown:
            ax.set_ylim(min(shown) / 2.0, max(shown) * room)
        ax.legend(loc="upper left")
    return figure


@styled
def calibration(study: Any, figure: Figure | SubFigure | None = None) -> Any:
    """Draw a rank histogram of each parameter with three standard deviations of uniform ranks, and all coverages.

    Parameters
    ----------
    study : path or mapping
        The folder of ``haloray study calibration``, its summary.json, or what that holds.
    figure : matplotlib Figure or SubFigure, optional
        Where to draw.

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
    summary: Any = cast("Any", study) if isinstance(study, Mapping) else json_of(study, "summary.json")
    parameters: list[dict[str, Any]] = list(summary["parameters"])
    figure, axes = panels(figure, -(-(len(parameters) + 1) // 4), 4, 0.75)
    for ax in axes.flat[len(parameters) + 1 :]:
        ax.set_axis_off()
    tallest = max((max(own["rank_counts"]) for own in parameters), default=1)
    for ax, own in zip(axes.flat, parameters):
        counts = np.asarray(own["rank_counts"], dtype=np.float64)
        bins, fits = len(counts), counts.sum()
        mean, sd = fits / bins, np.sqrt(fits / bins * (1.0 - 1.0 / bins))
        ax.axhspan(max(mean - 3.0 * sd, 0.0), mean + 3.0 * sd, color=GREY, alpha=0.25, lw=0.0)
        outline(ax, counts, np.linspace(0.0, 1.0, bins + 1), BLUE, width=0.9)
        p = own["p_value"]
        told = f"{p:.0e}" if p < 0.01 else f"{p:.2f}"
        ax.set_title(
            text(f"{symbol_of(own['name'])}: p = {told}, {100.0 * own['coverage']:.0f}%"), fontsize=7, loc="left", pad=3
        )
        ax.set(xlim=(0.0, 1.0), ylim=(0.0, max(1.45 * tallest, mean + 4.0 * sd)), xlabel="rank of the truth, fraction")
    for ax in axes[:, 0]:
        ax.set_ylabel("fits per bin")
    last = axes.flat[len(parameters)]
    last.axhspan(0.61, 0.75, color=GREY, alpha=0.25, lw=0.0)
    last.axhline(0.68, ls="--", lw=0.8, color=BLACK)
    last.plot(np.arange(1, len(parameters) + 1), [own["coverage"] for own in parameters], "o", ms=3, mew=0, color=RED)
    last.set(
        ylim=(0.4, 1.0), xlim=(0, len(parameters) + 1), xlabel="number of the panel", ylabel="fraction of the fits"
    )
    last.set_title("coverage of 68% intervals", fontsize=7, loc="left", pad=3)
    return figure


@styled
def recovery(table: Any, figure: Figure | SubFigure | None = None) -> Any:
    """Draw the shear that productive fits of a catalogue found against that put in, a row a model, coloured by log Q.

    Parameters
    ----------
    table : path, mapping or DataFrame
        The folder of ``haloray study catalogue``, its fits.csv, or its columns.
    figure : matplotlib Figure or SubFigure, optional
        Where to draw.

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
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize

    models = _models(table)
    qualities = finite(np.concatenate([own["log_quality"] for own in models.values()]))
    low, high = (qualities.min(), qualities.max()) if len(qualities) else (0.0, 1.0)
    if high - low < 0.1:
        low, high = low - 0.1, high + 0.1
    colours = ScalarMappable(Normalize(low, high), "viridis")
    drawn, axes = panels(figure, len(models), 2, 0.75, extra_mm=9.0)
    for row, (name, own) in zip(axes, models.items()):
        for i, ax in enumerate(row, start=1):
            true, found = own[f"gamma{i}_los_in"], own[f"gamma{i}_los_out"]
            ends = own[f"gamma{i}_los_low"], own[f"gamma{i}_los_high"]
            reach = 1.15 * max(0.01, float(np.abs(true).max(initial=0.0)))
            ax.plot([-reach, reach], [-reach, reach], ls="--", lw=0.8, color=GREY)
            for x, y, bottom, top, quality in zip(true, found, *ends, own["log_quality"]):
                colour = colours.to_rgba(quality) if np.isfinite(quality) else GREY
                ax.plot([x, x], [bottom, top], lw=0.7, color=colour)
                ax.plot(x, y, "o", ms=3, mew=0, color=colour)
                if abs(y) > 1.6 * reach:
                    marker, height = ("^", 0.975) if y > 0 else ("v", 0.025)
                    ax.plot(x, height, marker, ms=4, mew=0, color=colour, transform=ax.get_xaxis_transform())
            ax.set(xlim=(-reach, reach), ylim=(-1.6 * reach, 1.6 * reach))
            ax.set(xlabel=text(f"γ_{{{i}}}^{{LOS, in}}"), ylabel=text(f"γ_{{{i}}}^{{LOS, out}}"))
            ax.text(0.05, 0.92, name, transform=ax.transAxes)
    if len(qualities) and len(models):
        found_bar = drawn.colorbar(colours, ax=list(axes[0]), location="top", aspect=40, fraction=0.05)
        found_bar.set_label(text("log_{10} Q"))
    return drawn


@styled
def recovery_histograms(table: Any, figure: Figure | SubFigure | None = None) -> Any:
    """Draw histograms of σ and of the residuals in σ, one outline a model.

    Parameters
    ----------
    table, figure
        See :func:`recovery`.

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
    models = _models(table)
    figure, axes = panels(figure, 1, 2, 0.75)
    most = max((float(own["residual_in_sigma"].max(initial=0.0)) for own in models.values()), default=0.0)
    beyond = " (last bin: all beyond)" if most > 20.0 else ""
    widest = max((float(own["sigma"].max(initial=0.0)) for own in models.values()), default=0.0)
    kinds = [
        ("sigma", "σ(γ_{LOS})", max(widest, 1e-3)),
        ("residual_in_sigma", RESIDUAL + beyond, min(max(most, 2.0), 20.0)),
    ]
    for ax, (name, label, largest) in zip(axes[0], kinds):
        edges = np.linspace(0.0, largest, 21)
        for i, (model, own) in enumerate(models.items()):
            outline(ax, np.histogram(np.clip(own[name], 0.0, largest), edges)[0], edges, CYCLE[i % 5], model)
        ax.set(xlabel=text(label), ylabel="images")
        ax.legend(loc="upper right")
    return figure


@styled
def recovery_quality(
    table: Any,
    figure: Figure | SubFigure | None = None,
    *,
    model: str | None = None,
    lines: Sequence[tuple[float, float, str]] = (),
) -> Any:
    """Draw σ and the residual against image quality for one model.

    Parameters
    ----------
    table, figure
        See :func:`recovery`.
    model : str, optional
        Its name; the first unless given.
    lines : sequence of (slope, intercept, name)
        Straight lines of log σ in log Q.

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
    models = _models(table)
    own = next(iter(models.values())) if model is None else models[model]
    figure, axes = panels(figure, 1, 2, 0.75)
    quality = own["log_quality"]
    for ax, values, label in zip(
        axes[0], (np.log10(own["sigma"]), own["residual_in_sigma"]), ("log_{10} σ(γ_{LOS})", RESIDUAL)
    ):
        ax.plot(quality, values, "o", ms=3.2, mew=0, alpha=0.8, color=BLUE)
        ax.set(xlabel=text("log_{10} Q"), ylabel=text(label))
    for i, (slope, intercept, name) in enumerate(lines):
        ends = np.array([finite(quality).min(), finite(quality).max()])
        axes[0, 0].plot(ends, slope * ends + intercept, ls="--", lw=0.9, color=(BLACK, ORANGE)[i % 2], label=name)
    if lines:
        axes[0, 0].legend(loc="upper right")
    return figure


def _models(table: Any) -> dict[str, dict[str, Array]]:
    """The productive fits of each model that has any."""
    own = columns_of(table, "fits.csv")
    names = [str(name) for name in own["model"]]
    models: dict[str, dict[str, Array]] = {}
    for model in dict.fromkeys(names):
        rows = (np.array(names) == model) & (np.asarray(own["productive"], dtype=np.float64) > 0.0)
        if rows.any():
            found = {
                name: np.asarray(own[name], dtype=np.float64)[rows]
                for name in own
                if name not in ("model", "image", "unbounded")
            }
            with np.errstate(divide="ignore"):
                found["log_quality"] = np.log10(found["quality"]) if "quality" in found else np.full(rows.sum(), np.nan)
            models[model] = found
    return models
