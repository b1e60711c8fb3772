"""lenstronomy's ``LensModel``, evaluated by haloray."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, cast

import numpy as np

from ._cosmology import parameters
from ._errors import InputError
from ._haloray import Lens
from ._lens_arguments import LOS_MODELS, Kwargs, has_quantities, refuse_unsupported, source_of, without_quantities
from ._lens_results import CriticalCurve, PointImages
from ._units import Array, Points, items, names_in, number, one_of, optional, refuse, whole


class LensModel:
    """A drop-in for ``lenstronomy.LensModel.lens_model.LensModel``: same names, arguments and conventions.

    Parameters
    ----------
    lens_model_list : list of str
        Profiles of ``haloray.LENS_MODELS``, and at most one line-of-sight model.
    z_lens, z_source : float, optional
        Redshifts, for delays.
    lens_redshift_list : list of float, optional
        With ``multi_plane=True`` the redshift of every profile; deflections are reduced to the source.
    cosmo : optional
        A ``FlatLambdaCDM`` of astropy, or of colossus, without radiation, or (H0 in km/s/Mpc, Ωm); (67.4, 0.315) if left out.
    multi_plane : bool
        A plane for every redshift.
    **unsupported
        lenstronomy's other arguments are refused unless they have their default.

    Notes
    -----
    Derivatives are analytic, whatever ``diff`` says. Arguments may be Quantities. Planes at or behind the source do nothing, as :meth:`warnings` says. Where results differ from lenstronomy's, and who
    is right, is in docs/LENSTRONOMY.md.

    Examples
    --------
    >>> import haloray as hr
    >>> lens = hr.LensModel(["EPL", "SHEAR"])
    >>> kwargs = [{"theta_E": 1.5, "gamma": 2.0, "e1": 0.0, "e2": 0.0}, {"gamma1": 0.0, "gamma2": 0.0}]
    >>> lens.ray_shooting(3.0, 0.0, kwargs)
    (1.5, 0.0)
    """

    def __init__(
        self,
        lens_model_list: Sequence[str],
        z_lens: float | None = None,
        z_source: float | None = None,
        lens_redshift_list: Sequence[float] | None = None,
        cosmo: Any = None,
        multi_plane: bool = False,
        **unsupported: Any,
    ) -> None:
        refuse_unsupported(unsupported, z_source)
        self.lens_model_list: list[str] = names_in("lens_model_list", lens_model_list)
        self.multi_plane = bool(multi_plane)
        los = [name for name in self.lens_model_list if name in LOS_MODELS]
        if len(los) > 1:
            raise refuse("lens_model_list", lens_model_list, f"a list with one line-of-sight model, not {len(los)}")
        if los and self.multi_plane:
            raise refuse(
                "lens_model_list", lens_model_list, f"without {los[0]}, which has one plane, or multi_plane=False"
            )
        self.z_lens, self.z_source = optional("z_lens", z_lens), optional("z_source", z_source)
        self.redshift_list = (
            None
            if lens_redshift_list is None
            else [number("redshift", z) for z in items("lens_redshift_list", lens_redshift_list, "a list of redshifts")]
        )
        if self.multi_plane and self.redshift_list is None:
            raise InputError("lens_redshift_list is missing, but must be given with multi_plane=True")
        self.cosmo = cosmo
        self._static: Kwargs | None = None
        self._native = self._lens()

    def _lens(self) -> Lens:
        redshifts = self.redshift_list if self.multi_plane else None
        return Lens(self.lens_model_list, self.z_lens, self.z_source, redshifts, parameters(self.cosmo))

    @property
    def type(self) -> str:
        """lenstronomy's name of this kind of model."""
        if self.multi_plane:
            return "MultiPlane"
        los = [name for name in self.lens_model_list if name in LOS_MODELS]
        return "SinglePlane" if not los else "SinglePlaneLOSFlexion" if "FLEXION" in los[0] else "SinglePlaneLOS"

    @property
    def lens_model(self) -> LensModel:
        """The model itself, where lenstronomy has an inner object: its analytical solvers read ``lens_model.alpha_scaling``."""
        return self

    @property
    def alpha_scaling(self) -> float:
        """lenstronomy's factor of all deflections: 1."""
        return 1.0

    def change_source_redshift(self, z_source: float | None) -> None:
        """Do nothing for the model's own source redshift; deflections are reduced to that one.

        Parameters
        ----------
        z_source : float or None
            The redshift that the model has.

        Raises
        ------
        NotImplementedError
            For another: make a model with it and the arguments that belong to it.
        InputError
            What is no number.
        """
        if z_source is not None and number("z_source", z_source) != self.z_source:
            raise NotImplementedError("haloray.LensModel has one source: make another model for another redshift")

    @property
    def profile_kwargs_list(self) -> list[dict[str, Any]]:
        """lenstronomy's options of profiles: none."""
        return [{} for _ in self.lens_model_list]

    def __repr__(self) -> str:
        return f"<haloray.LensModel: {', '.join(self.lens_model_list)}>"

    def __reduce__(self) -> tuple[Any, ...]:
        arguments = (self.lens_model_list, self.z_lens, self.z_source, self.redshift_list, self.cosmo, self.multi_plane)
        return LensModel, arguments, {"_static": self._static}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self._static = state["_static"]

    def ray_shooting(self, x: Any, y: Any, kwargs: Kwargs, k: Any = None) -> tuple[Any, Any]:
        """Source positions β of image positions θ.

        Parameters
        ----------
        x, y : float or array_like
            Image positions, arcsec, of one shape.
        kwargs : list of dict
            The arguments of each model of the list.
        k : int or list of int, optional
            Only these profiles; the model of the line of sight is not counted and always there.

        Returns
        -------
        tuple
            β_x, β_y in arcsec, in the shape of x.

        Raises
        ------
        InputError
            Arguments missing, unknown or outside their domain; shapes that do not go together; numbers not finite.
        """
        if isinstance(x, float) and isinstance(y, float) and k is None and self._static is None:
            try:
                return self._native.ray(x, y, kwargs, None)
            except InputError:
                if not has_quantities(kwargs):
                    raise
        points = Points(("x", "y"), x, y)
        beta_x, beta_y, _, _ = self._trace(points, kwargs, k, 0)
        return points.shaped(beta_x), points.shaped(beta_y)

    def alpha(self, x: Any, y: Any, kwargs: Kwargs, k: Any = None, diff: float | None = None) -> tuple[Any, Any]:
        """Deflection α = θ − β.

        Parameters
        ----------
        x, y : float or array_like
            Image positions, arcsec, of one shape.
        kwargs, k
            See :meth:`ray_shooting`.
        diff : None
            lenstronomy's, not needed; refused with many planes, as there.

        Returns
        -------
        tuple
            α_x, α_y in arcsec, in the shape of x.

        Raises
        ------
        InputError
            See :meth:`ray_shooting`.
        """
        if diff is not None and self.multi_plane:
            raise refuse("diff", diff, "None with many planes, as in lenstronomy")
        points = Points(("x", "y"), x, y)
        beta_x, beta_y, _, _ = self._trace(points, kwargs, k, 0)
        return points.shaped(points.x - beta_x), points.shaped(points.y - beta_y)

    def hessian(
        self, x: Any, y: Any, kwargs: Kwargs, k: Any = None, diff: float | None = None, diff_method: str = "square"
    ) -> tuple[Any, Any, Any, Any]:
        """Hessian f_ij = ∂α_i/∂θ_j.

        Parameters
        ----------
        x, y : float or array_like
            Image positions, arcsec, of one shape.
        kwargs, k
            See :meth:`ray_shooting`.
        diff, diff_method
            lenstronomy's, not needed: derivatives are analytic.

        Returns
        -------
        tuple
            f_xx, f_xy, f_yx, f_yy, dimensionless, in the shape of x.

        Raises
        ------
        InputError
            See :meth:`ray_shooting`.
        """
        one_of("diff_method", diff_method, ("square", "cross"))
        points = Points(("x", "y"), x, y)
        _, _, jacobian, _ = self._trace(points, kwargs, k, 1)
        assert jacobian is not None
        shaped = points.shaped
        return (
            shaped(1.0 - jacobian[:, 0, 0]),
            shaped(-jacobian[:, 0, 1]),
            shaped(-jacobian[:, 1, 0]),
            shaped(1.0 - jacobian[:, 1, 1]),
        )

    def kappa(
        self, x: Any, y: Any, kwargs: Kwargs, k: Any = None, diff: float | None = None, diff_method: str = "square"
    ) -> Any:
        """Convergence ½(f_xx + f_yy).

        Parameters
        ----------
        x, y : float or array_like
            Image positions, arcsec, of one shape.
        kwargs, k
            See :meth:`ray_shooting`.
        diff, diff_method
            lenstronomy's, not needed: derivatives are analytic.

        Returns
        -------
        float or ndarray
            κ, dimensionless, in the shape of x.

        Raises
        ------
        InputError
            See :meth:`ray_shooting`.
        """
        f_xx, _, _, f_yy = self.hessian(x, y, kwargs, k)
        return 0.5 * (f_xx + f_yy)

    def curl(
        self, x: Any, y: Any, kwargs: Kwargs, k: Any = None, diff: float | None = None, diff_method: str = "square"
    ) -> Any:
        """Curl of the deflection, f_xy − f_yx.

        Parameters
        ----------
        x, y : float or array_like
            Image positions, arcsec, of one shape.
        kwargs, k
            See :meth:`ray_shooting`.
        diff, diff_method
            lenstronomy's, not needed: derivatives are analytic.

        Returns
        -------
        float or ndarray
            Dimensionless, in the shape of x.

        Raises
        ------
        InputError
            See :meth:`ray_shooting`.
        """
        _, f_xy, f_yx, _ = self.hessian(x, y, kwargs, k)
        return f_xy - f_yx

    def gamma(
        self, x: Any, y: Any, kwargs: Kwargs, k: Any = None, diff: float | None = None, diff_method: str = "square"
    ) -> tuple[Any, Any]:
        """Shear γ1 = ½(f_xx − f_yy), γ2 = f_xy.

        Parameters
        ----------
        x, y : float or array_like
            Image positions, arcsec, of one shape.
        kwargs, k
            See :meth:`ray_shooting`.
        diff, diff_method
            lenstronomy's, not needed: derivatives are analytic.

        Returns
        -------
        tuple
            γ1, γ2, dimensionless, in the shape of x.

        Raises
        ------
        InputError
            See :meth:`ray_shooting`.
        """
        f_xx, f_xy, _, f_yy = self.hessian(x, y, kwargs, k)
        return 0.5 * (f_xx - f_yy), f_xy

    def magnification(
        self, x: Any, y: Any, kwargs: Kwargs, k: Any = None, diff: float | None = None, diff_method: str = "square"
    ) -> Any:
        """Magnification 1/det A, A_ij = δ_ij − f_ij.

        Parameters
        ----------
        x, y : float or array_like
            Image positions, arcsec, of one shape.
        kwargs, k
            See :meth:`ray_shooting`.
        diff, diff_method
            lenstronomy's, not needed: derivatives are analytic.

        Returns
        -------
        float or ndarray
            Dimensionless, in the shape of x; infinite on critical curves.

        Raises
        ------
        InputError
            See :meth:`ray_shooting`.
        """
        f_xx, f_xy, f_yx, f_yy = self.hessian(x, y, kwargs, k)
        with np.errstate(divide="ignore"):
            magnification = 1.0 / np.asarray((1 - f_xx) * (1 - f_yy) - f_xy * f_yx)
        return magnification if magnification.ndim else float(magnification)

    def flexion(
        self, x: Any, y: Any, kwargs: Kwargs, k: Any = None, diff: float = 1e-4, hessian_diff: bool = False
    ) -> tuple[Any, Any, Any, Any]:
        """Third derivatives of the potential, as lenstronomy has them: ∂f_xx/∂x, ∂f_xx/∂y, ∂f_xy/∂y, ∂f_yy/∂y.

        Parameters
        ----------
        x, y : float or array_like
            Image positions, arcsec, of one shape.
        kwargs, k
            See :meth:`ray_shooting`.
        diff, hessian_diff
            lenstronomy's, not needed: derivatives are analytic.

        Returns
        -------
        tuple
            f_xxx, f_xxy, f_xyy, f_yyy per arcsec, in the shape of x.

        Raises
        ------
        InputError
            See :meth:`ray_shooting`.
        """
        points = Points(("x", "y"), x, y)
        _, _, _, second = self._trace(points, kwargs, k, 2)
        assert second is not None
        shaped = points.shaped
        return (
            shaped(-second[:, 0, 0, 0]),
            shaped(-second[:, 0, 0, 1]),
            shaped(-second[:, 0, 1, 1]),
            shaped(-second[:, 1, 1, 1]),
        )

    def potential(self, x: Any, y: Any, kwargs: Kwargs, k: Any = None) -> Any:
        """Lensing potential of the profiles of one plane, zero at their centres; the line of sight has none.

        Parameters
        ----------
        x, y : float or array_like
            Image positions, arcsec, of one shape.
        kwargs, k
            See :meth:`ray_shooting`.

        Returns
        -------
        float or ndarray
            arcsec², in the shape of x.

        Raises
        ------
        InputError
            See :meth:`ray_shooting`; many planes.
        """
        points = Points(("x", "y"), x, y)
        return points.shaped(self._native.potential(points.x, points.y, self._numbers(kwargs), self._only(k)))

    def fermat_potential(
        self, x_image: Any, y_image: Any, kwargs_lens: Kwargs, x_source: Any = None, y_source: Any = None
    ) -> Any:
        """Fermat potential of images.

        With many planes it is the arrival time over the time-delay distance of ``z_lens``.

        Parameters
        ----------
        x_image, y_image : float or array_like
            Image positions, arcsec, of one shape.
        kwargs_lens : list of dict
            The arguments of each model of the list.
        x_source, y_source : float or array_like, optional
            The source, arcsec; that of each ray if left out.

        Returns
        -------
        float or ndarray
            arcsec², in the shape of x_image.

        Raises
        ------
        InputError
            See :meth:`ray_shooting`; many planes without ``z_lens``.
        """
        points = Points(("x_image", "y_image"), x_image, y_image)
        if self.multi_plane:
            if self.z_lens is None:
                raise InputError("z_lens is missing, but must be given: it sets the time-delay distance of many planes")
            return self.arrival_time(x_image, y_image, kwargs_lens) / self._native.days_per_arcsec2(self.z_lens)
        source = None
        if x_source is not None and y_source is not None:
            source = source_of(points, x_source, y_source)
        numbers = self._numbers(kwargs_lens)
        return points.shaped(self._native.fermat_potential(points.x, points.y, numbers, source))

    def arrival_time(
        self,
        x_image: Any,
        y_image: Any,
        kwargs_lens: Kwargs,
        kappa_ext: float = 0,
        x_source: Any = None,
        y_source: Any = None,
    ) -> Any:
        """Arrival time of images, up to a constant; needs ``z_lens`` and ``z_source``, or redshifts of many planes.

        Parameters
        ----------
        x_image, y_image, kwargs_lens, x_source, y_source
            See :meth:`fermat_potential`; angles in arcsec.
        kappa_ext : float
            A convergence that is in no model: times are multiplied with 1 − κ_ext.

        Returns
        -------
        float or ndarray
            Days, in the shape of x_image.

        Raises
        ------
        InputError
            See :meth:`ray_shooting`; missing redshifts.
        """
        factor = 1.0 - number("kappa_ext", kappa_ext)
        if not self.multi_plane and x_source is not None and y_source is not None:
            days = self._native.days_per_arcsec2(self.z_lens)
            return self.fermat_potential(x_image, y_image, kwargs_lens, x_source, y_source) * (days * factor)
        points = Points(("x_image", "y_image"), x_image, y_image)
        return points.shaped(self._native.delay_days(points.x, points.y, self._numbers(kwargs_lens)) * factor)

    def point_source_images(
        self, x_source: float, y_source: float, kwargs: Kwargs, half_width_arcsec: float = 5.0
    ) -> PointImages:
        """All images of a point source, faint central ones included, and whether the count proves them complete.

        Parameters
        ----------
        x_source, y_source : float
            The source, arcsec.
        kwargs : list of dict
            See :meth:`ray_shooting`.
        half_width_arcsec : float
            Half the side of the window that is searched; widened where images may lie outside.

        Returns
        -------
        PointImages
            In order of arrival.

        Raises
        ------
        InputError
            See :meth:`ray_shooting`.
        """
        source = (number("x_source", x_source, "arcsec"), number("y_source", y_source, "arcsec"))
        half = number("half_width_arcsec", half_width_arcsec, "arcsec")
        return PointImages(**self._native.point_images(source, self._numbers(kwargs), half))

    def critical_curves(self, kwargs: Kwargs, half_width_arcsec: float = 5.0) -> list[CriticalCurve]:
        """Critical curves and caustics, largest first.

        Parameters
        ----------
        kwargs : list of dict
            See :meth:`ray_shooting`.
        half_width_arcsec : float
            Half the side of the window that is searched.

        Returns
        -------
        list of CriticalCurve
            With vertices in arcsec.

        Raises
        ------
        InputError
            See :meth:`ray_shooting`.
        """
        half = number("half_width_arcsec", half_width_arcsec, "arcsec")
        return [CriticalCurve(**own) for own in self._native.critical_curves(self._numbers(kwargs), half)]

    def einstein_radius(self, kwargs: Kwargs, centre_arcsec: tuple[float, float] | None = None) -> float | None:
        """Radius of the circle of mean convergence one.

        Parameters
        ----------
        kwargs : list of dict
            See :meth:`ray_shooting`.
        centre_arcsec : pair of float, optional
            The centre of the circle; that of the first profile if left out.

        Returns
        -------
        float or None
            arcsec; None if there is no such circle.

        Raises
        ------
        InputError
            See :meth:`ray_shooting`.
        """
        centre = None
        if centre_arcsec is not None:
            pair = items("centre_arcsec", centre_arcsec, "a pair of numbers")
            if len(pair) != 2:
                raise refuse("centre_arcsec", centre_arcsec, "a pair of numbers")
            x, y = pair
            centre = (number("centre_arcsec[0]", x, "arcsec"), number("centre_arcsec[1]", y, "arcsec"))
        return self._native.einstein_radius(self._numbers(kwargs), centre)

    def warnings(self, kwargs: Kwargs) -> list[str]:
        """Tell where results of these arguments differ from lenstronomy's on purpose.

        Parameters
        ----------
        kwargs : list of dict
            See :meth:`ray_shooting`.

        Returns
        -------
        list of str
            A sentence each.

        Raises
        ------
        InputError
            See :meth:`ray_shooting`.
        """
        return self._native.warnings(self._numbers(kwargs))

    def check_parameters(self, kwargs_list: Kwargs) -> None:
        """Check that every model has its arguments, each in its domain.

        Parameters
        ----------
        kwargs_list : list of dict
            See :meth:`ray_shooting`.

        Raises
        ------
        InputError
            See :meth:`ray_shooting`.
        """
        self._native.warnings(self._numbers(kwargs_list))

    def set_static(self, kwargs: Kwargs) -> Kwargs:
        """Keep these arguments for all calls to come.

        Parameters
        ----------
        kwargs : list of dict
            See :meth:`ray_shooting`.

        Returns
        -------
        list of dict
            The same.

        Raises
        ------
        InputError
            See :meth:`ray_shooting`.
        """
        self.check_parameters(kwargs)
        self._static = [dict(model) for model in kwargs]
        return kwargs

    def set_dynamic(self) -> None:
        """Take the arguments of each call again."""
        self._static = None

    def _trace(
        self, points: Points, kwargs: Kwargs, k: Any, order: int
    ) -> tuple[Array, Array, Array | None, Array | None]:
        return self._native.trace(points.x, points.y, self._numbers(kwargs), self._only(k), order)

    def _numbers(self, kwargs: Kwargs) -> Kwargs:
        """The arguments as the native side reads them: quantities as numbers."""
        kwargs = kwargs if self._static is None else self._static
        return without_quantities(self.lens_model_list, kwargs) if has_quantities(kwargs) else kwargs

    def _only(self, k: Any) -> list[int] | None:
        if k is None:
            return None
        if isinstance(k, (list, tuple, np.ndarray)):
            chosen = list(cast("Sequence[object]", k))
            if chosen and all(isinstance(own, (bool, np.bool_)) for own in chosen):
                return [i for i, own in enumerate(chosen) if own]
            return [whole("k", own) for own in chosen]
        return [whole("k", k)]


__all__ = ["LensModel"]
