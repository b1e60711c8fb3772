"""What tidal and flexion models of a line of sight predict on its axis."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ._units import Array, one_of


@dataclass(frozen=True)
class Tidal:
    """Tidal matrix of a part of the line of sight: 1 − A = [[κ+γ1, γ2−ω], [γ2+ω, κ−γ1]].

    Attributes
    ----------
    kappa, gamma1, gamma2, omega : float
        Convergence κ, shear γ1, γ2 and rotation ω, dimensionless.
    """

    kappa: float
    gamma1: float
    gamma2: float
    omega: float

    def jacobian(self) -> Array:
        """The matrix A = ∂β/∂θ.

        Returns
        -------
        ndarray, shape (2, 2)
            A, dimensionless.
        """
        kappa, gamma1, gamma2, omega = self.kappa, self.gamma1, self.gamma2, self.omega
        return np.array([[1 - kappa - gamma1, omega - gamma2], [-omega - gamma2, 1 - kappa + gamma1]])


@dataclass(frozen=True)
class Flexion:
    """Flexion of a part of the line of sight, by the convention of lenstronomy's models.

    Attributes
    ----------
    F1, F2, G1, G2 : float
        F = ∂γ and G = ∂*γ per arcsec, half of Bacon's.
    """

    F1: float
    F2: float
    G1: float
    G2: float


TIDAL = ("kappa", "gamma1", "gamma2", "omega")


_STILL = ("kappa", "gamma1", "gamma2")


FLEXION = ("F1", "F2", "G1", "G2")


#: For each of lenstronomy's models: which quantities of which places it takes.
_MODELS: dict[str, list[tuple[tuple[str, ...], str]]] = {
    "LOS": [(TIDAL, "od"), (TIDAL, "os"), (TIDAL, "ds")],
    "LOS_MINIMAL": [(TIDAL, "od"), (TIDAL, "los")],
    "LOS_FLEXION": [
        (_STILL, "od"),
        (TIDAL, "os"),
        (_STILL, "ds"),
        (FLEXION, "od"),
        (FLEXION, "os"),
        (FLEXION, "1ds"),
        (FLEXION, "2ds"),
    ],
    "LOS_FLEXION_MINIMAL": [
        (_STILL, "od"),
        (TIDAL, "los"),
        (FLEXION, "od"),
        (FLEXION, "los"),
        (FLEXION, "1los"),
    ],
}


@dataclass(frozen=True)
class Effective:
    """What tidal and flexion models of a line of sight predict on its axis, main lens excluded.

    Attributes
    ----------
    od, os, ds : Tidal
        Observer to lens, observer to source, lens to source.
    los : Tidal
        A_LOS = A_odᵀ A_ds⁻¹ A_os, exactly.
    los_linear : Tidal
        To first order: od + os − ds.
    flexion : dict of str to Flexion
        By place: ``od``, ``os``, ``ds``, ``1ds``, ``2ds``, and ``los``, ``1los`` of the minimal model.
    """

    od: Tidal
    os: Tidal
    ds: Tidal
    los: Tidal
    los_linear: Tidal
    flexion: dict[str, Flexion]
    _values: dict[str, float]

    def kwargs(self, model: str = "LOS_MINIMAL") -> dict[str, float]:
        """The keyword arguments of lenstronomy's (and :class:`LensModel`'s) model of that name.

        Parameters
        ----------
        model : {"LOS", "LOS_MINIMAL", "LOS_FLEXION", "LOS_FLEXION_MINIMAL"}
            The flexion-minimal model is of first order throughout, its κ_LOS, γ_LOS too.

        Returns
        -------
        dict of str to float
            Dimensionless convergences, shears and rotations; flexions per arcsec.

        Raises
        ------
        InputError
            Another model.
        """
        model = one_of("model", model, list(_MODELS))
        # The minimal flexion model's own convergence, shear and rotation, to its order.
        first_order = model == "LOS_FLEXION_MINIMAL"
        named: dict[str, float] = {}
        for quantities, place in _MODELS[model]:
            source = "los_flexion" if first_order and place == "los" and quantities is TIDAL else place
            named.update({f"{quantity}_{place}": self._values[f"{quantity}_{source}"] for quantity in quantities})
        return named
