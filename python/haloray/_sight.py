"""A line of sight: rays through every halo, exactly or to a stated accuracy."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ._decoupled import DecoupledMultiPlane, Lens, decoupled, lens_of
from ._effective import FLEXION, TIDAL, Effective, Flexion, Tidal
from ._haloes import Haloes, HaloesLike, as_haloes
from ._haloray import Sight
from ._packages import package
from ._progress import Progress, callback
from ._units import Array, Points, expect, number, optional, refuse, whole

if TYPE_CHECKING:
    import xarray


class Rays(NamedTuple):
    """Where rays come from, and how their bundles are distorted; what was not asked for is None.

    Attributes
    ----------
    beta_x_arcsec, beta_y_arcsec : float or ndarray
        β of each ray, arcsec, in the shape of the directions.
    jacobian : ndarray, shape (…, 2, 2), or None
        A_ij = ∂β_i/∂θ_j, dimensionless.
    second_per_arcsec : ndarray, shape (…, 2, 2, 2), or None
        b_ijk = ∂²β_i/∂θ_j∂θ_k per arcsec.
    """

    beta_x_arcsec: Any
    beta_y_arcsec: Any
    jacobian: Array | None
    second_per_arcsec: Array | None


class LineOfSight:
    """Haloes sorted into lens planes, each with its sheet, ready to be traced between any two redshifts.

    Parameters
    ----------
    haloes : Haloes, table, path or mapping of columns
        See :class:`Haloes`.
    z_source : float, optional
        Redshift of the source; that of the haloes if left out. Haloes with masses may be put before another source.
    sheets : {"on-axis", "on-ray", "none", "mean-density"}, optional
        What compensates the mass of the haloes: in each plane the halo's own convergence on the axis, or where the axis ray
        passes; nothing; the share of the mean density. What the haloes were drawn for if left out, else ``"on-axis"``.
    reference : {"bent", "straight"}, optional
        The line from which positions are measured: one that haloes do not bend, or the axis ray itself.
    accuracy_arcsec : float or "exact"
        Largest error of a ray; ``"exact"`` sends every ray through every plane. 1e-7″ if left out.
    cosmology : optional
        See :meth:`Haloes.from_columns`; of haloes that are no :class:`Haloes` yet.

    Notes
    -----
    Every method takes ``x_arcsec``, ``y_arcsec``: numbers or arrays of one shape, or Quantities of angle. ``z_from`` and ``z_to``
    choose another stretch than observer to source: from a lens plane on, about the ray that the observer sees on the axis, or
    up to one. ``lens`` puts a main lens on the way: (redshift, name of a profile, its arguments), such as
    ``(0.5, "EPL", {"theta_E": 1.5, "gamma": 2.1, "e1": 0.0, "e2": 0.0})``.
    """

    def __init__(
        self,
        haloes: HaloesLike,
        z_source: float | None = None,
        *,
        sheets: str | None = None,
        reference: str | None = None,
        accuracy_arcsec: float | str = 1e-7,
        cosmology: Any = None,
    ) -> None:
        self.haloes: Haloes = as_haloes(haloes, optional("z_source", z_source), cosmology)
        made_for = self.haloes._made_for or ("on-axis", "bent")
        self.sheets: str = made_for[0] if sheets is None else expect("sheets", sheets, str, "a name")
        self.reference: str = made_for[1] if reference is None else expect("reference", reference, str, "a name")
        self.accuracy_arcsec = _accuracy(accuracy_arcsec)
        self._native = Sight(self.haloes._native, self.sheets, self.reference)

    def __len__(self) -> int:
        return len(self._native)

    def __repr__(self) -> str:
        return f"<haloray.LineOfSight: {len(self)} planes, sheets {self.sheets}, reference {self.reference}>"

    def __reduce__(self) -> tuple[Any, ...]:
        return _restored, (self.haloes, self.sheets, self.reference, self.accuracy_arcsec)

    @property
    def z_source(self) -> float:
        """Redshift of the source."""
        return self.haloes.z_source

    @property
    def sheet_convergence(self) -> float:
        """Convergence that all sheets together take away, reduced to the source."""
        return self._native.sheet_convergence()

    def trace(
        self,
        x_arcsec: Any,
        y_arcsec: Any,
        order: int = 0,
        *,
        z_from: float | None = None,
        z_to: float | None = None,
        lens: Lens | None = None,
        progress: Progress = None,
    ) -> Rays:
        """Trace rays.

        Parameters
        ----------
        x_arcsec, y_arcsec : float, array_like or Quantity
            Directions at the observer (at ``z_from`` if given), arcsec.
        order : {0, 1, 2}
            Derivatives: none, the Jacobian, second derivatives too. All are analytic.
        z_from, z_to, lens
            See the class.
        progress : bool or callable, optional
            See :func:`populate`.

        Returns
        -------
        Rays

        Raises
        ------
        InputError
            Shapes that do not go together, numbers that are not finite, redshifts outside the line of sight.
        KeyboardInterrupt
            Soon after Ctrl-C.
        """
        points = Points(("x_arcsec", "y_arcsec"), x_arcsec, y_arcsec)
        way = _Way(z_from, z_to, lens, self.accuracy_arcsec)
        order = whole("order", order, 0, 2)
        x, y, jacobian, second = self._native.trace(points.x, points.y, way, order, callback(progress))
        shaped = points.shaped
        return Rays(
            shaped(x),
            shaped(y),
            None if jacobian is None else shaped(jacobian),
            None if second is None else shaped(second),
        )

    def ray_shooting(self, x_arcsec: Any, y_arcsec: Any, **way: Any) -> tuple[Any, Any]:
        """Trace rays to their β.

        Parameters
        ----------
        x_arcsec, y_arcsec : float, array_like or Quantity
            Directions, arcsec.
        **way
            ``z_from``, ``z_to``, ``lens``, ``progress`` as in :meth:`trace`.

        Returns
        -------
        tuple
            β_x and β_y in arcsec, in the shape of the directions.

        Raises
        ------
        InputError
            See :meth:`trace`.
        """
        rays = self.trace(x_arcsec, y_arcsec, 0, **way)
        return rays.beta_x_arcsec, rays.beta_y_arcsec

    def alpha(self, x_arcsec: Any, y_arcsec: Any, **way: Any) -> tuple[Any, Any]:
        """Trace rays to their deflection α = θ − β.

        Parameters
        ----------
        x_arcsec, y_arcsec, **way
            See :meth:`ray_shooting`.

        Returns
        -------
        tuple
            α_x and α_y in arcsec, in the shape of the directions.

        Raises
        ------
        InputError
            See :meth:`trace`.
        """
        points = Points(("x_arcsec", "y_arcsec"), x_arcsec, y_arcsec)
        rays = self.trace(points.x, points.y, 0, **way)
        return points.shaped(points.x - rays.beta_x_arcsec), points.shaped(points.y - rays.beta_y_arcsec)

    def jacobian(self, x_arcsec: Any, y_arcsec: Any, **way: Any) -> Array:
        """Trace rays with their Jacobian A_ij = ∂β_i/∂θ_j.

        Parameters
        ----------
        x_arcsec, y_arcsec, **way
            See :meth:`ray_shooting`.

        Returns
        -------
        ndarray, shape (…, 2, 2)
            A of each ray, dimensionless; … is the shape of the directions.

        Raises
        ------
        InputError
            See :meth:`trace`.
        """
        found = self.trace(x_arcsec, y_arcsec, 1, **way).jacobian
        assert found is not None
        return found

    def hessian(self, x_arcsec: Any, y_arcsec: Any, **way: Any) -> tuple[Any, Any, Any, Any]:
        """Trace rays with lenstronomy's Hessian f_ij = δ_ij − ∂β_i/∂θ_j.

        Parameters
        ----------
        x_arcsec, y_arcsec, **way
            See :meth:`ray_shooting`.

        Returns
        -------
        tuple
            f_xx, f_xy, f_yx, f_yy, dimensionless, in the shape of the directions.

        Raises
        ------
        InputError
            See :meth:`trace`.
        """
        jacobian = self.jacobian(x_arcsec, y_arcsec, **way)
        return 1.0 - jacobian[..., 0, 0], -jacobian[..., 0, 1], -jacobian[..., 1, 0], 1.0 - jacobian[..., 1, 1]

    def flexion(self, x_arcsec: Any, y_arcsec: Any, **way: Any) -> Array:
        """Trace rays with their second derivatives b_ijk = ∂²β_i/∂θ_j∂θ_k.

        Parameters
        ----------
        x_arcsec, y_arcsec, **way
            See :meth:`ray_shooting`.

        Returns
        -------
        ndarray, shape (…, 2, 2, 2)
            b of each ray per arcsec; … is the shape of the directions.

        Raises
        ------
        InputError
            See :meth:`trace`.
        """
        found = self.trace(x_arcsec, y_arcsec, 2, **way).second_per_arcsec
        assert found is not None
        return found

    def arrival_time(
        self,
        x_arcsec: Any,
        y_arcsec: Any,
        *,
        z_from: float | None = None,
        z_to: float | None = None,
        lens: Lens | None = None,
    ) -> Any:
        """Delay of rays against the straight path to the same β; differences between images are observable.

        Parameters
        ----------
        x_arcsec, y_arcsec : float, array_like or Quantity
            Directions, arcsec.
        z_from, z_to, lens
            See :meth:`trace`.

        Returns
        -------
        float or ndarray
            Days, in the shape of the directions.

        Raises
        ------
        InputError
            See :meth:`trace`.
        """
        points = Points(("x_arcsec", "y_arcsec"), x_arcsec, y_arcsec)
        way = _Way(z_from, z_to, lens, self.accuracy_arcsec)
        return points.shaped(self._native.delay_days(points.x, points.y, way))

    def effective(self, z_lens: float) -> Effective:
        """The tensors of the axis ray that tidal and flexion models take, with the main lens at ``z_lens``.

        Parameters
        ----------
        z_lens : float
            Redshift of the main lens.

        Returns
        -------
        Effective
            Tensors and flexions, for :class:`LensModel` and lenstronomy.

        Raises
        ------
        InputError
            Unless 0 < z_lens < z_source, and A_ds can be inverted.
        """
        values = self._native.effective(number("z_lens", z_lens))

        def tidal(place: str) -> Tidal:
            return Tidal(*(values[f"{quantity}_{place}"] for quantity in TIDAL))

        places = ("od", "os", "ds", "1ds", "2ds", "los", "1los")
        flexion = {place: Flexion(*(values[f"{name}_{place}"] for name in FLEXION)) for place in places}
        return Effective(
            tidal("od"), tidal("os"), tidal("ds"), tidal("los"), tidal("los_linear"), flexion, dict(values)
        )

    def maps(
        self,
        points: int = 121,
        half_width_arcsec: float = 3.6,
        *,
        z_from: float | None = None,
        z_to: float | None = None,
        lens: Lens | None = None,
        progress: Progress = None,
    ) -> xarray.Dataset:
        """Maps of the distortion on a square grid about the axis.

        Parameters
        ----------
        points : int
            Nodes a side.
        half_width_arcsec : float
            Largest \\|θ_x\\| and \\|θ_y\\|, arcsec.
        z_from, z_to, lens, progress
            See :meth:`trace`.

        Returns
        -------
        xarray.Dataset
            ``kappa``, ``gamma1``, ``gamma2``, ``omega``, ``abs_f``, ``abs_g`` (per arcsec) and ``delta`` over
            (``theta_y``, ``theta_x``) in arcsec.

        Raises
        ------
        InputError
            Arguments outside their domain.
        ImportError
            Without xarray (``pip install xarray``).
        """
        way = _Way(z_from, z_to, lens, self.accuracy_arcsec)
        half_width_arcsec = number("half_width_arcsec", half_width_arcsec, "arcsec")
        points = whole("points", points, 2, 4096)
        return dataset(self._native.maps(points, half_width_arcsec, way, callback(progress)))

    def to_decoupled_multiplane(self, lens: Lens, half_width_arcsec: float = 2.5, n: int = 201) -> DecoupledMultiPlane:
        """Tables for lenstronomy's decoupled multi-plane (``decouple_multi_plane=True``), around a fiducial main lens.

        Behind the fiducial lens lenstronomy's β is that of all haloes but for the interpolation; behind another one the
        haloes beyond the lens are taken along the fiducial rays: ``error(x, y, lens)`` of the result says what that costs.

        Parameters
        ----------
        lens : (redshift, name, arguments)
            The fiducial main lens; see the class.
        half_width_arcsec : float
            Largest \\|θ_x\\| and \\|θ_y\\| of the tables; lenstronomy refuses rays outside.
        n : int
            Nodes a side.

        Returns
        -------
        DecoupledMultiPlane
            ``kwargs`` is ``kwargs_multiplane_model``, ``error_arcsec`` the largest error behind the fiducial lens.

        Raises
        ------
        InputError
            Arguments outside their domain.
        """
        return decoupled(self, lens, half_width_arcsec, n)

    def to_interpol(
        self,
        half_width_arcsec: float,
        n: int = 201,
        *,
        lens: Lens | None = None,
        progress: Progress = None,
    ) -> Interpol:
        """The deflection as a grid for lenstronomy's ``INTERPOL``.

        Parameters
        ----------
        half_width_arcsec : float
            Half the side of the grid.
        n : int
            Nodes a side.
        lens, progress
            See :meth:`trace`.

        Returns
        -------
        Interpol
            Keyword arguments, and the largest error of β that their interpolation makes.

        Raises
        ------
        InputError
            Arguments outside their domain.

        Notes
        -----
        Haloes at several redshifts turn images; a potential does not. ``INTERPOL`` is given α and its symmetric Hessian, and
        no potential: time delays are :meth:`arrival_time`'s.
        """
        half = number("half_width_arcsec", half_width_arcsec, "arcsec")
        n = whole("n", n, 4, 4096)
        if not half > 0.0:
            raise refuse("half_width_arcsec", half, "positive")
        axis = np.linspace(-half, half, n)
        x, y = np.meshgrid(axis, axis)
        rays = self.trace(x, y, 1, lens=lens, progress=progress)
        jacobian = rays.jacobian
        assert jacobian is not None
        kwargs = {
            "grid_interp_x": axis,
            "grid_interp_y": axis,
            "f_x": x - rays.beta_x_arcsec,
            "f_y": y - rays.beta_y_arcsec,
            "f_xx": 1.0 - jacobian[..., 0, 0],
            "f_yy": 1.0 - jacobian[..., 1, 1],
            "f_xy": -0.5 * (jacobian[..., 0, 1] + jacobian[..., 1, 0]),
        }
        middle = 0.5 * (axis[1:] + axis[:-1])
        x, y = np.meshgrid(middle, middle)
        exact = self.trace(x, y, 0, lens=lens, progress=progress)
        errors = [
            _midpoints(kwargs["f_x"]) - (x - exact.beta_x_arcsec),
            _midpoints(kwargs["f_y"]) - (y - exact.beta_y_arcsec),
        ]
        return Interpol(kwargs, float(np.max(np.hypot(*errors))))


@dataclass(frozen=True)
class Interpol:
    """Keyword arguments of lenstronomy's ``INTERPOL``.

    Attributes
    ----------
    kwargs : dict
        ``grid_interp_x``, ``grid_interp_y``, ``f_x``, ``f_y``, ``f_xx``, ``f_yy``, ``f_xy``.
    error_arcsec : float
        Largest \\|β − β_traced\\| in the middle of the cells, where *linear* interpolation is worst; lenstronomy's splines do better
        where the field is smooth.
    """

    kwargs: dict[str, Array]
    error_arcsec: float


class _Way:
    """From where to where, through what and how accurately, as the native side reads it."""

    __slots__ = ("accuracy_arcsec", "lens", "z_from", "z_to")

    def __init__(
        self,
        z_from: float | None,
        z_to: float | None,
        lens: Lens | None,
        accuracy_arcsec: float | str,
    ) -> None:
        self.z_from, self.z_to = optional("z_from", z_from), optional("z_to", z_to)
        self.accuracy_arcsec = accuracy_arcsec
        self.lens = None if lens is None else lens_of(lens)


def _accuracy(accuracy: Any) -> float | str:
    if isinstance(accuracy, str):
        if accuracy == "exact":
            return accuracy
        raise refuse("accuracy_arcsec", accuracy, '"exact" or a positive number of arcsec')
    arcsec = number("accuracy_arcsec", accuracy, "arcsec")
    if not 0.0 < arcsec < float("inf"):
        raise refuse("accuracy_arcsec", arcsec, '"exact" or a positive number of arcsec')
    return arcsec


def _midpoints(grid: Array) -> Array:
    """Linear interpolation in the middle of the cells."""
    return 0.25 * (grid[1:, 1:] + grid[1:, :-1] + grid[:-1, 1:] + grid[:-1, :-1])


def _restored(haloes: Haloes, sheets: str, reference: str, accuracy_arcsec: float | str) -> LineOfSight:
    return LineOfSight(haloes, sheets=sheets, reference=reference, accuracy_arcsec=accuracy_arcsec)


def dataset(maps: dict[str, Any]) -> xarray.Dataset:
    """Maps by name, each (unit, values), as an xarray data set."""
    maps = dict(maps)
    axis = maps.pop("theta_arcsec")
    dims = ("theta_y", "theta_x")
    variables = {name: (dims, values, {"units": unit} if unit else {}) for name, (unit, values) in maps.items()}
    coordinate = {"units": "arcsec"}
    coords = {"theta_y": ("theta_y", axis, coordinate), "theta_x": ("theta_x", axis, coordinate)}
    found: xarray.Dataset = package("xarray", "maps are xarray data sets").Dataset(variables, coords)
    return found


__all__ = ["Interpol", "LineOfSight", "Rays"]
