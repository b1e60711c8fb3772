"""Realisations of pyHalo as haloes."""

from __future__ import annotations

import math
from typing import Any

from ._errors import InputError
from ._haloes import Haloes
from ._units import expect, items, mapping, number, refuse

_FIELDS = {
    "Rs": "r_s_arcsec",
    "alpha_Rs": "alpha_rs_arcsec",
    "center_x": "theta_x_arcsec",
    "center_y": "theta_y_arcsec",
    "r_trunc": "r_trunc_arcsec",
}


def from_pyhalo(
    realization: Any, z_source: float | None = None, cosmology: Any = None
) -> tuple[Haloes, list[tuple[float, float]]]:
    """Haloes of a pyHalo realisation, with its sheets of negative convergence.

    Parameters
    ----------
    realization : pyHalo realisation
        Its haloes must be NFW or truncated NFW (``TNFW``), as in its CDM and WDM presets.
    z_source : float, optional
        Redshift of the source; the realisation's if left out.
    cosmology : optional
        See :meth:`Haloes.from_columns`; that of the realisation if left out. Radiation is left out of distances.

    Returns
    -------
    haloes : Haloes
        The haloes, by their angles in arcsec.
    sheets : list of (float, float)
        Redshift and convergence κ < 0 of each sheet, reduced to the source, as the realisation gives lenstronomy them.

    Raises
    ------
    InputError
        A profile that is neither NFW nor TNFW.

    Notes
    -----
    :class:`LineOfSight` puts sheets of its own in the planes of haloes; ``sheets="none"`` leaves them out. The realisation
    with its own sheets is ``LensModel(models, z_source=…, lens_redshift_list=redshifts, multi_plane=True)`` of its lists.
    """
    if not hasattr(realization, "lensing_quantities"):
        raise refuse("realization", realization, "a realisation of pyHalo")
    own = getattr(realization, "astropy_instance", None)
    if cosmology is None and own is not None:
        cosmology = (number("H0", own.H0, "km / (s Mpc)"), number("Om0", own.Om0))
    models, redshifts, kwargs, _ = realization.lensing_quantities(add_mass_sheet_correction=True)
    z_source = number("z_source", realization.lens_cosmo.z_source if z_source is None else z_source)
    return from_lens_models(models, redshifts, kwargs, z_source, cosmology)


def from_lens_models(
    models: list[str], redshifts: Any, kwargs: list[dict[str, float]], z_source: float, cosmology: Any = None
) -> tuple[Haloes, list[tuple[float, float]]]:
    """Haloes and sheets of lenstronomy's keyword lists: ``NFW``, ``TNFW`` and ``CONVERGENCE``.

    Parameters
    ----------
    models : list of str
        ``NFW``, ``TNFW`` and ``CONVERGENCE``.
    redshifts : list of float
        Of each model.
    kwargs : list of dict
        lenstronomy's arguments, angles in arcsec.
    z_source : float
        Redshift of the source that angles are reduced to.
    cosmology : optional
        See :meth:`Haloes.from_columns`.

    Returns
    -------
    haloes : Haloes
        Of ``NFW`` and ``TNFW``.
    sheets : list of (float, float)
        Redshift and convergence of each ``CONVERGENCE``.

    Raises
    ------
    InputError
        Another profile; arguments missing or outside their domain.
    """
    names, places = items("models", models, "a list of names"), items("redshifts", redshifts, "a list of numbers")
    arguments = items("kwargs", kwargs, "a list of dictionaries")
    if not len(names) == len(places) == len(arguments):
        raise InputError(
            f"there are {len(names)} models, {len(places)} redshifts and {len(arguments)} sets of arguments, "
            "but must be as many of each"
        )
    columns: dict[str, list[float]] = {"z": [], **{name: [] for name in _FIELDS.values()}}
    sheets: list[tuple[float, float]] = []
    for name, place, given in zip(names, places, arguments):
        own, z = mapping(f"arguments of {name}", given, "a dictionary"), number("redshift", place)
        if name == "CONVERGENCE":
            sheets.append((z, number("kappa of CONVERGENCE", own.get("kappa"))))
            continue
        if name not in ("NFW", "TNFW"):
            raise InputError(f"a profile is {name}, but must be NFW or TNFW, or the sheet CONVERGENCE")
        columns["z"].append(z)
        for theirs, ours in _FIELDS.items():
            default = math.inf if theirs == "r_trunc" else 0.0 if theirs.startswith("center") else None
            value = own.get(theirs, default)
            if value is None:
                raise InputError(f"argument {theirs} of {name} is missing, but must be given")
            columns[ours].append(number(f"{theirs} of {name}", value))
    return Haloes.from_columns(columns, z_source, cosmology), sheets


def to_lens_models(haloes: Haloes) -> tuple[list[str], list[float], list[dict[str, float]]]:
    """Keyword lists of lenstronomy's multi-plane mode, of haloes.

    Parameters
    ----------
    haloes : Haloes
        NFW, and TNFW where they have a truncation radius.

    Returns
    -------
    tuple
        ``lens_model_list``, ``lens_redshift_list`` and ``kwargs_lens``, angles in arcsec.

    Raises
    ------
    InputError
        What is no :class:`Haloes`.
    """
    truncation = expect("haloes", haloes, Haloes, "haloray.Haloes").r_trunc_arcsec
    names: list[str] = []
    kwargs: list[dict[str, float]] = []
    for i in range(len(haloes)):
        own = {
            "Rs": float(haloes.r_s_arcsec[i]),
            "alpha_Rs": float(haloes.alpha_rs_arcsec[i]),
            "center_x": float(haloes.theta_x_arcsec[i]),
            "center_y": float(haloes.theta_y_arcsec[i]),
        }
        radius = math.inf if truncation is None else float(truncation[i])
        if math.isfinite(radius):
            own["r_trunc"] = radius
        names.append("TNFW" if math.isfinite(radius) else "NFW")
        kwargs.append(own)
    return names, [float(z) for z in haloes.z], kwargs


__all__ = ["from_lens_models", "from_pyhalo", "to_lens_models"]
