"""A line of sight for lenstronomy's decoupled multi-plane: its rays, tabulated around a fiducial main lens."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Protocol

import numpy as np

from ._errors import InputError
from ._haloes import Haloes
from ._lens_model import LensModel
from ._packages import package
from ._units import Array, Points, number, refuse, whole

#: Of a main lens: (redshift, name of a profile, its arguments).
Lens = tuple[float, str, dict[str, float]]


class Sight(Protocol):
    """What the tables are made of: a :class:`LineOfSight`."""

    @property
    def haloes(self) -> Haloes: ...
    @property
    def z_source(self) -> float: ...
    def ray_shooting(self, x_arcsec: Any, y_arcsec: Any, **way: Any) -> tuple[Any, Any]: ...


@dataclass(frozen=True)
class DecoupledMultiPlane:
    """Tables for ``decouple_multi_plane=True`` of lenstronomy's ``LensModel``; made by :meth:`LineOfSight.to_decoupled_multiplane`.

    With x the transverse comoving position at the lens plane and α the main lens's deflection there,
    β = [x + T_ds (α_foreground − α T_s/T_ds + α_background)]/T_s. The two interpolated angles stand in one sum, which is that of
    the traced rays behind the fiducial lens; lenstronomy holds it for every lens.

    Attributes
    ----------
    kwargs : dict
        ``kwargs_multiplane_model`` of lenstronomy's ``LensModel``.
    error_arcsec : float
        Largest error in β of the tables behind the fiducial lens, measured in the middle of their cells.
    lens : tuple
        The fiducial lens: redshift, profile, arguments.
    """

    kwargs: dict[str, Any]
    error_arcsec: float
    lens: Lens
    _sight: Sight
    _comoving: tuple[float, float, float]

    def ray_shooting(self, x_arcsec: Any, y_arcsec: Any, lens: Lens | None = None) -> tuple[Any, Any]:
        """Trace rays as lenstronomy's decoupled multi-plane does.

        Parameters
        ----------
        x_arcsec, y_arcsec : float or array_like
            Directions within the tables, arcsec.
        lens : (redshift, name, arguments), optional
            Another main lens, in the same plane.

        Returns
        -------
        tuple
            β_x and β_y in arcsec, in the shape of the directions.

        Raises
        ------
        InputError
            Directions outside the tables; a lens that cannot be.
        """
        points = Points(("x_arcsec", "y_arcsec"), x_arcsec, y_arcsec)
        _, name, arguments = self.lens if lens is None else lens_of(lens)
        half = float(self.kwargs["x0_interp"].grid[0][-1])
        outside = np.flatnonzero(~((np.abs(points.x) <= half) & (np.abs(points.y) <= half)))
        if len(outside):
            x, y = points.x[outside[0]], points.y[outside[0]]
            raise InputError(
                f"point {outside[0]} is ({x:g}, {y:g}) arcsec, but must be within {half:g} of the axis, as the tables are"
            )
        at = (points.x, points.y)
        to_lens, to_source, between = self._comoving
        x, y = self.kwargs["x0_interp"](at), self.kwargs["y0_interp"](at)
        alpha = LensModel([name]).alpha(x / to_lens, y / to_lens, [dict(arguments)])
        found: list[Any] = []
        for axis, place, bend in (("x", x, alpha[0]), ("y", y, alpha[1])):
            foreground = self.kwargs[f"alpha_{axis}_interp_foreground"](at)
            background = self.kwargs[f"alpha_{axis}_interp_background"](at)
            angle = foreground - bend * to_source / between + background
            found.append(points.shaped((place + between * angle) / to_source))
        return found[0], found[1]

    def error(self, x_arcsec: Any, y_arcsec: Any, lens: Lens | None = None) -> Any:
        """How far these β are from rays traced through all haloes behind ``lens``, arcsec.

        Parameters
        ----------
        x_arcsec, y_arcsec, lens
            See :meth:`ray_shooting`.

        Returns
        -------
        float or ndarray
            \\|β − β_traced\\| in arcsec, in the shape of the directions.

        Raises
        ------
        InputError
            See :meth:`ray_shooting`.
        """
        traced = self._sight.ray_shooting(x_arcsec, y_arcsec, lens=self.lens if lens is None else lens)
        found = self.ray_shooting(x_arcsec, y_arcsec, lens)
        return np.hypot(found[0] - traced[0], found[1] - traced[1])


def lens_of(lens: Any) -> Lens:
    """A main lens with numbers; quantities are converted."""
    try:
        z_lens, name, arguments = lens
        named = dict(arguments)
    except (TypeError, ValueError) as error:
        raise refuse("lens", lens, "(redshift, name of a profile, its arguments)") from error
    numbers = {str(own): number(str(own), value, _unit_of(str(own))) for own, value in named.items()}
    return number("redshift of the lens", z_lens), str(name), numbers


def _unit_of(name: str) -> str | None:
    """The unit of an argument of a profile that may come as a quantity."""
    angles = ("theta_E", "center_x", "center_y", "Rs", "alpha_Rs", "r_trunc", "R_sersic")
    return "arcsec" if name in angles else None


def decoupled(sight: Sight, lens: Lens, half_width_arcsec: Any, n: Any) -> DecoupledMultiPlane:
    """Rays of ``sight`` on a grid, as tables around ``lens``."""
    interpolate = package("scipy.interpolate", "to_decoupled_multiplane needs scipy, as lenstronomy does")
    half, n = number("half_width_arcsec", half_width_arcsec, "arcsec"), whole("n", n, 4, 4096)
    if not 0.0 < half < float("inf"):
        raise InputError(f"half_width_arcsec is {half}, but must be positive and finite")
    lens = lens_of(lens)
    z_lens, name, arguments = lens
    to_lens, to_source = _comoving(sight, z_lens), _comoving(sight, sight.z_source)
    between = to_source - to_lens
    axis = np.linspace(-half, half, n)
    theta = np.stack(np.meshgrid(axis, axis, indexing="ij"))
    at_lens = np.stack(sight.ray_shooting(*theta, z_to=z_lens))
    beta = np.stack(sight.ray_shooting(*theta, lens=lens))
    alpha = np.stack(LensModel([name]).alpha(at_lens[0], at_lens[1], [dict(arguments)]))
    # The direction of the undeflected ray in front, all that haloes and lens do behind.
    background = (to_source * beta - to_lens * at_lens) / between + alpha * to_source / between - theta

    def table(values: Array) -> Any:
        return interpolate.RegularGridInterpolator((axis, axis), values, method="linear", bounds_error=True)

    kwargs = {
        "x0_interp": table(to_lens * at_lens[0]),
        "y0_interp": table(to_lens * at_lens[1]),
        "alpha_x_interp_foreground": table(theta[0]),
        "alpha_y_interp_foreground": table(theta[1]),
        "alpha_x_interp_background": table(background[0]),
        "alpha_y_interp_background": table(background[1]),
        "z_split": z_lens,
    }
    found = DecoupledMultiPlane(kwargs, float("nan"), lens, sight, (to_lens, to_source, between))
    middle = 0.5 * (axis[1:] + axis[:-1])
    worst = float(np.max(found.error(*np.meshgrid(middle, middle))))
    return replace(found, error_arcsec=worst)


def _comoving(sight: Sight, z: float) -> float:
    """Comoving distance in Mpc, by Gauss–Legendre quadrature of c/H in the flat cosmology of the haloes."""
    hubble, matter = sight.haloes.cosmology
    nodes, weights = np.polynomial.legendre.leggauss(96)
    at = 0.5 * z * (nodes + 1.0)
    rate = np.sqrt(matter * (1.0 + at) ** 3 + 1.0 - matter)
    return float(299_792.458 / hubble * 0.5 * z * np.sum(weights / rate))
