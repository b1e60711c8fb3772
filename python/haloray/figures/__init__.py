"""The command's figures in matplotlib, to be changed.

Every function draws a saved result. One that fills a single panel takes the Axes ``ax`` and returns it; one of several panels
takes a Figure or SubFigure ``figure`` and returns it. Without, they make their own, as wide as a column (84 mm) or a page
(174 mm) of MNRAS. matplotlib is imported when something is drawn.

>>> import haloray as hr
>>> figure = hr.figures.images("run")                  # doctest: +SKIP
>>> figure.savefig("images.pdf")                       # doctest: +SKIP

==========================  =========================================================================================
of a run                    :func:`mass_function`, :func:`cylinder`, :func:`histograms`, :func:`tidal_maps`,
                            :func:`flexion_maps`, :func:`images`
of an image, mocks          :func:`exposure`, :func:`mosaic`
of a lens                   :func:`curves`, :func:`overlay`
of a fit                    :func:`reconstruction`, :func:`corner`, :func:`trace`, :func:`source_plane`,
                            :func:`profiles`
of an ensemble              :func:`distributions`, :func:`joint`, :func:`settling`
of studies                  :func:`calibration`, :func:`cut`, :func:`deviations`, :func:`recovery`,
                            :func:`recovery_histograms`, :func:`recovery_quality`, :func:`expected`,
                            :func:`smoothing`
of the tidal approximation  :func:`tidal_residuals`, :func:`validity_fitted_shears`, :func:`validity_coverage`,
                            :func:`validity_excess`, :func:`validity_failing`, :func:`validity_delays`,
                            :func:`validity_haloes`
==========================  =========================================================================================
"""

from .._drawing.style import STYLE
from ._ensemble import distributions, joint, settling
from ._expected import expected, smoothing
from ._fit import corner, profiles, reconstruction, source_plane, trace
from ._images import exposure, images, mosaic
from ._lens import curves, overlay
from ._maps import flexion_maps, tidal_maps
from ._run import cylinder, histograms, mass_function
from ._studies import (
    calibration,
    cut,
    deviations,
    recovery,
    recovery_histograms,
    recovery_quality,
    tidal_residuals,
)
from ._validity import (
    validity_coverage,
    validity_delays,
    validity_excess,
    validity_failing,
    validity_fitted_shears,
    validity_haloes,
)

__all__ = [
    "STYLE",
    "calibration",
    "corner",
    "curves",
    "cut",
    "cylinder",
    "deviations",
    "distributions",
    "expected",
    "exposure",
    "flexion_maps",
    "histograms",
    "images",
    "joint",
    "mass_function",
    "mosaic",
    "overlay",
    "profiles",
    "reconstruction",
    "recovery",
    "recovery_histograms",
    "recovery_quality",
    "settling",
    "smoothing",
    "source_plane",
    "tidal_maps",
    "tidal_residuals",
    "trace",
    "validity_coverage",
    "validity_delays",
    "validity_excess",
    "validity_failing",
    "validity_fitted_shears",
    "validity_haloes",
]
