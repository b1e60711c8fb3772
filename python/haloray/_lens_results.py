"""What a lens model finds: images of a point source, critical curves."""

from __future__ import annotations

from dataclasses import dataclass

from ._units import Array


@dataclass(frozen=True, eq=False)
class PointImages:
    """The images of a point source, in order of arrival.

    Attributes
    ----------
    theta_arcsec : ndarray, shape (n, 2)
        Directions.
    jacobian : ndarray, shape (n, 2, 2)
        A = ∂β/∂θ.
    magnification, delay_days : ndarray, shape (n,)
        1/det A, negative for mirrored images; arrival after the first, not a number without redshifts.
    kind : list of str
        ``minimum``, ``saddle`` or ``maximum`` of the arrival time.
    is_complete : bool
        Whether parities add up to the winding of β − β_s along the edge of the window, as they must when none is missing.
    doubt : str or None
        Why not, in words.
    """

    theta_arcsec: Array
    jacobian: Array
    magnification: Array
    delay_days: Array
    kind: list[str]
    is_complete: bool
    doubt: str | None


@dataclass(frozen=True, eq=False)
class CriticalCurve:
    """A critical curve with its caustic, vertex by vertex.

    Attributes
    ----------
    kind : {"tangential", "radial"}
        Which eigenvalue vanishes.
    closed : bool
        False where it leaves the window.
    theta_arcsec, beta_arcsec : ndarray, shape (n, 2)
        The curve, and the caustic.
    area_arcsec2 : float
        Inside the curve.
    """

    kind: str
    closed: bool
    theta_arcsec: Array
    beta_arcsec: Array
    area_arcsec2: float
