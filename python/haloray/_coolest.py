"""COOLEST (Galan et al. 2023) in and out: templates of lens models by its conventions.

Position angles are from +y counter-clockwise in (−90°, 90°], axis ratios minor over major, radii √(ab). haloray's (and
lenstronomy's) e1, e2 are (1 − q)/(1 + q) times cos 2φ, sin 2φ with φ from +x counter-clockwise; radii are the same.
"""

from __future__ import annotations

import json
import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, cast

from ._cosmology import parameters
from ._errors import InputError, MissingFileError
from ._lens_model import LensModel
from ._packages import package
from ._units import Array, image, items, mapping, number, path_of

Kwargs = Sequence[Mapping[str, Any]]


@dataclass(frozen=True)
class CoolestModel:
    """A lens model of a COOLEST template, as lenstronomy's lists.

    Attributes
    ----------
    lens_model_list, source_light_model_list, lens_light_model_list : list of str
        Profiles of the masses before the source, and of the lights of source and lenses.
    kwargs_lens, kwargs_source, kwargs_lens_light : list of dict
        Their arguments.
    lens_redshift_list : list of float
        Where the masses are.
    z_lens, z_source : float
        Redshift of the first mass; of the farthest entity.
    cosmology : tuple of float
        H0 in km/s/Mpc and Ωm.
    """

    lens_model_list: list[str]
    kwargs_lens: list[dict[str, float]]
    lens_redshift_list: list[float]
    z_lens: float
    z_source: float
    source_light_model_list: list[str] = field(default_factory=list[str])
    kwargs_source: list[dict[str, float]] = field(default_factory=list[dict[str, float]])
    lens_light_model_list: list[str] = field(default_factory=list[str])
    kwargs_lens_light: list[dict[str, float]] = field(default_factory=list[dict[str, float]])
    cosmology: tuple[float, float] = (67.4, 0.315)

    def lens_model(self) -> LensModel:
        """The masses; in one plane where they have one redshift.

        Returns
        -------
        LensModel
            With its redshifts and cosmology; its arguments are ``kwargs_lens``.

        Raises
        ------
        InputError
            A profile without the redshifts that it needs.
        """
        planes = len(set(self.lens_redshift_list)) > 1
        redshifts = self.lens_redshift_list if planes else None
        z_lens = None if planes else self.z_lens
        return LensModel(self.lens_model_list, z_lens, self.z_source, redshifts, self.cosmology, multi_plane=planes)


def from_coolest(path: str | os.PathLike[str]) -> CoolestModel:
    """Read the lens model of a COOLEST template (.json): its point estimates.

    Masses PEMD, SIE, ExternalShear, ConvergenceSheet and lights Sersic are read.

    Parameters
    ----------
    path : path
        The template, plain JSON.

    Returns
    -------
    CoolestModel
        Masses before the farthest entity, and the lights of all; angles in arcsec, position angles turned into e1, e2.

    Raises
    ------
    InputError
        A file that is no COOLEST template, a profile that haloray does not have, a parameter without a value.
    MissingFileError
        No such file.
    """
    name = path_of("path", path)
    try:
        with open(name, encoding="utf-8") as file:
            content: Any = json.load(file)
    except FileNotFoundError as error:
        raise MissingFileError(f"cannot read {name}: no such file") from error
    except (ValueError, OSError) as error:
        raise InputError(f"{name} is no COOLEST template: {error}") from error
    found = cast("dict[str, Any]", content) if isinstance(content, dict) else {}
    if found.get("standard") != "COOLEST":
        raise InputError(f"{name} is no COOLEST template: standard is not COOLEST")
    entities: list[Any] = found.get("lensing_entities", [])
    redshifts = [number(f"redshift of {own.get('name')}", own["redshift"]) for own in entities]
    if not redshifts:
        raise InputError(f"{name} has no lensing entities")
    z_source = max(redshifts)
    masses: list[tuple[str, dict[str, float], float]] = []
    lights: dict[bool, list[tuple[str, dict[str, float]]]] = {True: [], False: []}
    for own, z in zip(entities, redshifts):
        for profile in own.get("mass_model", []):
            if z < z_source:
                masses.append((*_mass_in(profile), z))
        for profile in own.get("light_model", []):
            lights[z == z_source].append(_light_in(profile))
    if not masses:
        raise InputError(f"{name} has no mass before its source")
    about: dict[str, Any] = found.get("cosmology") or {}
    return CoolestModel(
        [mass[0] for mass in masses],
        [mass[1] for mass in masses],
        [mass[2] for mass in masses],
        masses[0][2],
        z_source,
        [light[0] for light in lights[True]],
        [light[1] for light in lights[True]],
        [light[0] for light in lights[False]],
        [light[1] for light in lights[False]],
        (number("H0", about["H0"]), number("Om0", about["Om0"])) if about else (67.4, 0.315),
    )


def to_coolest(
    path: str | os.PathLike[str],
    lens_model_list: Sequence[str],
    kwargs_lens: Kwargs,
    *,
    z_lens: float,
    z_source: float,
    source_light_model_list: Sequence[str] = (),
    kwargs_source: Kwargs = (),
    lens_light_model_list: Sequence[str] = (),
    kwargs_lens_light: Kwargs = (),
    image_e_s: Any = None,
    pixel_scale_arcsec: float | None = None,
    cosmology: Any = None,
) -> None:
    """Write a COOLEST template (.json) with the ``coolest`` package, mode ``MAP``.

    COOLEST has no entity for a line of sight: models ``LOS…`` are refused. Shears and sheets are a ``MassField``, all other
    masses the lens galaxy.

    Parameters
    ----------
    path : path
        Where; ends in .json.
    lens_model_list, kwargs_lens
        EPL, SIE, SIS, SHEAR (about the axis), CONVERGENCE, with lenstronomy's arguments.
    z_lens, z_source : float
        Redshifts.
    source_light_model_list, kwargs_source, lens_light_model_list, kwargs_lens_light
        SERSIC or SERSIC_ELLIPSE.
    image_e_s : array_like, shape (n, n), optional
        The image, (y, x), e⁻/s; it goes into a FITS file beside the template.
    pixel_scale_arcsec : float, optional
        The width of its pixels.
    cosmology : optional
        See :meth:`Haloes.from_columns`.

    Raises
    ------
    InputError
        A profile that COOLEST does not have.
    """
    lazy, serial, standard = (
        package(f"coolest.template.{own}", "to_coolest needs the coolest package")
        for own in ("lazy", "json", "standard")
    )
    name = os.path.abspath(path_of("path", path))
    if not name.endswith(".json"):
        raise InputError(f"path is {name}, but must end in .json")
    masses = [_mass_out(own, kwargs) for own, kwargs in _pairs("lens", lens_model_list, kwargs_lens)]
    fields = [mass for mass in masses if mass[0] in ("ExternalShear", "ConvergenceSheet")]
    others = [mass for mass in masses if mass not in fields]
    source = [_light_out(own, kwargs) for own, kwargs in _pairs("source", source_light_model_list, kwargs_source)]
    lens = [_light_out(own, kwargs) for own, kwargs in _pairs("lens light", lens_light_model_list, kwargs_lens_light)]

    def filled(model: Any, profiles: list[tuple[str, dict[str, float]]]) -> Any:
        found = model(*(kind for kind, _ in profiles))
        for place, (_, values) in enumerate(profiles):
            for own, value in values.items():
                found[place].parameters[own].set_point_estimate(value)
        return found

    z_lens, z_source = number("z_lens", z_lens), number("z_source", z_source)
    entities: list[Any] = []
    if fields:
        entities.append(lazy.MassField("line of sight", z_lens, mass_model=filled(lazy.MassModel, fields)))
    entities.append(
        lazy.Galaxy(
            "lens", z_lens, mass_model=filled(lazy.MassModel, others), light_model=filled(lazy.LightModel, lens)
        )
    )
    entities.append(lazy.Galaxy("source", z_source, light_model=filled(lazy.LightModel, source)))
    grid, scale = None, 1.0
    if image_e_s is not None:
        scale = number("pixel_scale_arcsec", pixel_scale_arcsec, "arcsec")
        grid = _grid(lazy, name.removesuffix(".json") + "_image.fits", image("image_e_s", image_e_s), scale)
    hubble, matter = parameters(cosmology)
    template = standard.COOLEST(
        "MAP",
        lazy.CoordinatesOrigin("0d", "0d"),
        lazy.LensingEntityList(*entities),
        lazy.Observation(grid),
        lazy.Instrument(scale),
        lazy.Cosmology(hubble, matter),
        metadata={"writer": "haloray"},
    )
    serial.JSONSerializer(name.removesuffix(".json"), obj=template, check_external_files=False).dump_simple()


def _grid(lazy: Any, path: str, pixels: Array, scale: float) -> Any:
    """The image as FITS, and as COOLEST's grid."""
    fits = package("astropy.io.fits", "to_coolest needs astropy for an image")
    fits.writeto(path, pixels, overwrite=True)
    half, n = 0.5 * len(pixels) * scale, len(pixels)
    view = {"field_of_view_x": (-half, half), "field_of_view_y": (-half, half)}
    return lazy.PixelatedRegularGrid(os.path.basename(path), num_pix_x=n, num_pix_y=n, **view)


def position_angle_deg(e1: float, e2: float) -> float:
    """Angle from +y counter-clockwise in (−90°, 90°] of an ellipticity or shear whose angle from +x is ½ atan2(e2, e1)."""
    angle = math.degrees(0.5 * math.atan2(e2, e1)) - 90.0
    return angle + 180.0 if angle <= -90.0 else angle


def components(size: float, angle_deg: float) -> tuple[float, float]:
    """(e1, e2) of that size at an angle from +y."""
    double = 2.0 * math.radians(angle_deg + 90.0)
    return size * math.cos(double), size * math.sin(double)


_CENTRE = {"center_x": 0.0, "center_y": 0.0}
_ELLIPSE = {"e1": 0.0, "e2": 0.0, **_CENTRE}


def _taken(
    name: str, kwargs: Mapping[str, Any], required: Sequence[str], optional: Mapping[str, float]
) -> dict[str, float]:
    """The arguments of a profile as numbers, defaults filled in; others are refused."""
    for own in kwargs:
        if own not in required and own not in optional:
            raise InputError(f"argument of {name} is {own!r}, but must be one of {', '.join([*required, *optional])}")
    for own in required:
        if own not in kwargs:
            raise InputError(f"argument {own} of {name} is missing, but must be given")
    values = {**optional, **{own: kwargs[own] for own in kwargs}}
    return {own: number(f"{own} of {name}", value) for own, value in values.items()}


def _ellipse_out(own: Mapping[str, float]) -> dict[str, float]:
    size = math.hypot(own["e1"], own["e2"])
    return {
        "q": (1.0 - size) / (1.0 + size),
        "phi": position_angle_deg(own["e1"], own["e2"]),
        "center_x": own["center_x"],
        "center_y": own["center_y"],
    }


def _mass_out(name: str, kwargs: Mapping[str, Any]) -> tuple[str, dict[str, float]]:
    if name == "EPL":
        own = _taken(name, kwargs, ("theta_E", "gamma", "e1", "e2"), _CENTRE)
        return "PEMD", {"theta_E": own["theta_E"], "gamma": own["gamma"], **_ellipse_out(own)}
    if name in ("SIE", "SIS"):
        needed = ("theta_E", "e1", "e2") if name == "SIE" else ("theta_E",)
        own = {"e1": 0.0, "e2": 0.0, **_taken(name, kwargs, needed, _CENTRE)}
        return "SIE", {"theta_E": own["theta_E"], **_ellipse_out(own)}
    if name == "SHEAR":
        own = _taken(name, kwargs, ("gamma1", "gamma2"), {"ra_0": 0.0, "dec_0": 0.0})
        if own["ra_0"] != 0.0 or own["dec_0"] != 0.0:
            raise InputError("ra_0, dec_0 of SHEAR must be 0: COOLEST's shear is about the origin")
        gamma = math.hypot(own["gamma1"], own["gamma2"])
        return "ExternalShear", {"gamma_ext": gamma, "phi_ext": position_angle_deg(own["gamma1"], own["gamma2"])}
    if name == "CONVERGENCE":
        own = _taken(name, kwargs, ("kappa",), {"ra_0": 0.0, "dec_0": 0.0})
        if own["ra_0"] != 0.0 or own["dec_0"] != 0.0:
            raise InputError("ra_0, dec_0 of CONVERGENCE must be 0: COOLEST's sheet is about the origin")
        return "ConvergenceSheet", {"kappa_s": own["kappa"]}
    raise InputError(f"profile is {name!r}, but must be one that COOLEST has: EPL, SIE, SIS, SHEAR or CONVERGENCE")


def _light_out(name: str, kwargs: Mapping[str, Any]) -> tuple[str, dict[str, float]]:
    if name not in ("SERSIC", "SERSIC_ELLIPSE"):
        raise InputError(f"light is {name!r}, but must be SERSIC or SERSIC_ELLIPSE")
    optional = _ELLIPSE if name == "SERSIC_ELLIPSE" else _CENTRE
    own = {**_ELLIPSE, **_taken(name, kwargs, ("amp", "R_sersic", "n_sersic"), optional)}
    return "Sersic", {"I_eff": own["amp"], "theta_eff": own["R_sersic"], "n": own["n_sersic"], **_ellipse_out(own)}


def _values(profile: Mapping[str, Any], names: Sequence[str]) -> dict[str, float]:
    found: dict[str, float] = {}
    for own in names:
        value = profile["parameters"].get(own, {}).get("point_estimate", {}).get("value")
        if value is None:
            raise InputError(f"{own} of {profile['type']} has no point estimate in the template")
        found[own] = number(f"{own} of {profile['type']}", value)
    return found


def _ellipse_in(own: Mapping[str, float]) -> dict[str, float]:
    e1, e2 = components((1.0 - own["q"]) / (1.0 + own["q"]), own["phi"])
    return {"e1": e1, "e2": e2, "center_x": own["center_x"], "center_y": own["center_y"]}


_SHAPE = ("q", "phi", "center_x", "center_y")


def _mass_in(profile: Mapping[str, Any]) -> tuple[str, dict[str, float]]:
    kind = profile["type"]
    if kind in ("PEMD", "SIE"):
        own = _values(profile, ("theta_E", *(("gamma",) if kind == "PEMD" else ()), *_SHAPE))
        return "EPL", {"theta_E": own["theta_E"], "gamma": own.get("gamma", 2.0), **_ellipse_in(own)}
    if kind == "ExternalShear":
        own = _values(profile, ("gamma_ext", "phi_ext"))
        gamma1, gamma2 = components(own["gamma_ext"], own["phi_ext"])
        return "SHEAR", {"gamma1": gamma1, "gamma2": gamma2}
    if kind == "ConvergenceSheet":
        return "CONVERGENCE", {"kappa": _values(profile, ("kappa_s",))["kappa_s"]}
    raise InputError(f"mass profile is {kind!r}, but must be PEMD, SIE, ExternalShear or ConvergenceSheet")


def _light_in(profile: Mapping[str, Any]) -> tuple[str, dict[str, float]]:
    kind = profile["type"]
    if kind != "Sersic":
        raise InputError(f"light profile is {kind!r}, but must be Sersic")
    own = _values(profile, ("I_eff", "theta_eff", "n", *_SHAPE))
    light = {"amp": own["I_eff"], "R_sersic": own["theta_eff"], "n_sersic": own["n"], **_ellipse_in(own)}
    return "SERSIC_ELLIPSE", light


def _pairs(what: str, names: Sequence[str], kwargs: Kwargs) -> list[tuple[str, Mapping[str, Any]]]:
    models = items(f"models of the {what}", names, "a list of names")
    arguments = items(f"arguments of the {what}", kwargs, "a list of dictionaries")
    if len(models) != len(arguments):
        raise InputError(
            f"arguments of the {what} are {len(arguments)}, but must be as many as its models, {len(models)}"
        )
    return [(name, mapping(f"arguments of {name}", own, "a dictionary")) for name, own in zip(models, arguments)]


__all__ = ["CoolestModel", "from_coolest", "to_coolest"]
