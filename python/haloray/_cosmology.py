"""Cosmologies at the border: flat, matter and a cosmological constant."""

from __future__ import annotations

from typing import Any, cast

from ._errors import InputError
from ._units import number, refuse

#: H0 in km/s/Mpc and Ωm of the distances unless others are given.
DEFAULT = (67.4, 0.315)


def parameters(cosmology: Any) -> tuple[float, float]:
    """H0 in km/s/Mpc and Ωm of ``None``, of a pair, of a dictionary with H0 and Om0, of an astropy ``FlatLambdaCDM`` or of colossus."""
    if cosmology is None:
        return DEFAULT
    if isinstance(cosmology, dict):
        named = cast("dict[object, object]", cosmology)
        if set(named) != {"H0", "Om0"}:
            raise refuse("cosmology", named, "a dictionary with H0 (km/s/Mpc) and Om0")
        return number("H0", named["H0"], "km / (s Mpc)"), number("Om0", named["Om0"])
    if hasattr(cosmology, "H0") and hasattr(cosmology, "Om0"):
        _check_flat_matter(cosmology)
        return number("H0", cosmology.H0, "km / (s Mpc)"), number("Om0", cosmology.Om0)
    try:
        hubble, matter = cosmology
    except (TypeError, ValueError) as error:
        allowed = "a FlatLambdaCDM of astropy or colossus, a dictionary with H0 and Om0, or a pair (H0 in km/s/Mpc, Om0)"
        raise refuse("cosmology", cosmology, allowed) from error
    return number("H0", hubble, "km / (s Mpc)"), number("Om0", matter)


def _check_flat_matter(cosmology: Any) -> None:
    # colossus knows the temperature for its transfer functions even where its distances leave radiation out.
    has_radiation = getattr(cosmology, "relspecies", True)
    temperature = number("Tcmb0", getattr(cosmology, "Tcmb0", 0.0), "K") if has_radiation else 0.0
    if temperature != 0.0:
        raise InputError(
            f"Tcmb0 of the cosmology is {temperature} K, but must be 0: haloray's distances have no radiation; "
            "use astropy.cosmology.FlatLambdaCDM(H0, Om0), or relspecies=False in colossus"
        )
    total = number("Ode0", getattr(cosmology, "Ode0", 1.0)) + number("Om0", cosmology.Om0)
    if abs(total - 1.0) > 1e-9 or getattr(cosmology, "w0", -1.0) not in (-1.0, -1):
        raise InputError("the cosmology is not flat ΛCDM, but must be: use astropy.cosmology.FlatLambdaCDM(H0, Om0)")
