"""Images on the sky."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from .._drawing.style import BLACK, FLUX, WHITE, bar, caption, image_norm, panels, quantile, raster, styled, symmetric
from .._mock import Mock, MockImage
from .._run import Image
from ._lens import curves_of_group, lay_over
from ._saved import RunLike, group_of, half_of, run_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure, SubFigure


@styled
def images(run: RunLike, figure: Figure | SubFigure | None = None) -> Any:
    """Draw the images of a run through all haloes and through those in the tidal regime, and their difference.

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
    both = [group_of(own, f"images/{name}") for name in ("all_haloes", "tidal_haloes")]
    about = own.attributes["images/all_haloes"]
    background = about["background_rms_e_s"]
    rows = [[both[0][kind], both[1][kind], both[0][kind] - both[1][kind]] for kind in ("noise_free", "noisy")]
    half = half_of(rows[0][0].shape[0], about["pixel_scale_arcsec"])
    norm = image_norm(rows[0][:2], background)
    largest = [quantile(np.abs(row[2]), 0.995) or 0.0 for row in rows]
    difference = symmetric(largest)
    figure, axes = panels(figure, 2, 3, 1.0, extra_mm=9.0, sharex=True)
    threshold = own.setting("diagnostics", "delta_threshold")
    names = ["all haloes", f"tidal haloes (Δ_{{h}} < {threshold:g})", "all − tidal"]
    shown: list[Any] = []
    for row, told in enumerate(["noise-free", "with noise"]):
        for i in range(3):
            ax, cmap = axes[row, i], "RdBu_r" if i == 2 else "inferno"
            shown.append(raster(ax, rows[row][i], half, difference if i == 2 else norm, cmap, i == 0))
            caption(ax, names[i], cmap)
            caption(ax, told, cmap, (0.05, 0.07))
            if row == 0:
                ax.set_xlabel("")
            if i < 2:
                lay_over(ax, curves_of_group(own, f"images/{('all_haloes', 'tidal_haloes')[i]}/curves"), "white")
    bar(figure, shown[0], list(axes[0, :2]), FLUX)
    bar(figure, shown[2], axes[0, 2], "all − tidal [e^{−} s^{−1} pixel^{−1}]")
    return figure


@styled
def exposure(
    image: Image | MockImage, figure: Figure | SubFigure | None = None, *, background_rms_e_s: float | None = None
) -> Any:
    """Draw one exposure before and with noise.

    Parameters
    ----------
    image : haloray.Image or MockImage
        What :func:`haloray.image` returns, or an image of :func:`haloray.mock`.
    figure : matplotlib Figure or SubFigure, optional
        Where to draw.
    background_rms_e_s : float, optional
        Where the stretch turns from linear to logarithmic; the image's own unless given.

    Returns
    -------
    matplotlib Figure or SubFigure
        What was drawn into.

    Raises
    ------
    AttributeError
        What is no image.
    """
    scale = image.pixel_scale_arcsec
    background = _background(image) if background_rms_e_s is None else background_rms_e_s
    norm, half = image_norm([image.noise_free_e_s], background), half_of(image.noisy_e_s.shape[0], scale)
    figure, axes = panels(figure, 1, 2, 1.0, extra_mm=9.0)
    grids = [(image.noise_free_e_s, "noise-free"), (image.noisy_e_s, "with noise")]
    shown: Any = None
    for i, (values, name) in enumerate(grids):
        shown = raster(axes[0, i], values, half, norm, "inferno", i == 0)
        caption(axes[0, i], name, "inferno")
    bar(figure, shown, list(axes[0]), FLUX)
    return figure


@styled
def mosaic(mock: Mock, figure: Figure | SubFigure | None = None, *, columns: int | None = None) -> Any:
    """Draw all images of a catalogue, each with a stretch and a scale bar of its own.

    Parameters
    ----------
    mock : haloray.Mock
        With images; the first 144 are drawn.
    figure : matplotlib Figure or SubFigure, optional
        Where to draw.
    columns : int, optional
        Images in a row; as many as rows unless given.

    Returns
    -------
    matplotlib Figure or SubFigure
        What was drawn into.

    Raises
    ------
    ValueError
        Mocks without images.
    """
    from matplotlib import patheffects

    shown = mock.images[:144]
    across = math.ceil(math.sqrt(len(shown))) if columns is None else columns
    figure, axes = panels(figure, math.ceil(len(shown) / across), across, 1.0)
    for ax in axes.flat[len(shown) :]:
        ax.set_axis_off()
    for ax, image, number in zip(axes.flat, shown, mock["number"]):
        n, scale = image.noisy_e_s.shape[0], image.pixel_scale_arcsec
        width = n * scale
        raster(ax, image.noisy_e_s, 0.5 * width, image_norm([image.noisy_e_s], _background(image)), "inferno")
        ax.set(xticks=[], yticks=[], xlabel="", ylabel="")
        ax.minorticks_off()
        caption(ax, f"{number:.0f}", "inferno", (0.06, 0.9))
        length = next((own for own in (0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0) if own >= 0.2 * width), 20.0)
        right, low = 0.44 * width, -0.44 * width
        for colour, thickness in ((BLACK, 2.6), (WHITE, 1.4)):
            ax.plot([right - length, right], [low, low], color=colour, lw=thickness)
        halo = [patheffects.withStroke(linewidth=1.5, foreground=BLACK)]
        ax.text(right - 0.5 * length, low + 0.03 * width, f"{length:g}″", color=WHITE, ha="center", path_effects=halo)
    return figure


def _background(image: Any) -> float:
    """Rms of the background: that of the configuration, or of the camera of the mocks."""
    if isinstance(image, Image):
        return image.background_rms_e_s
    from .._haloray import mock_instrument

    return mock_instrument()[1]
