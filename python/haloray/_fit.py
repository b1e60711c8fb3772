"""Fits: an image and a model to a posterior."""

from __future__ import annotations

import json
import os
import warnings
from collections.abc import Mapping
from dataclasses import dataclass, fields
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any, Union, cast

from . import _haloray
from ._config import as_json
from ._drawing.corner import corner
from ._errors import FileError, InputError, MissingFileError
from ._haloray import Observation as _Observation
from ._haloray import fit as _fit
from ._packages import package
from ._progress import Progress, callback
from ._run import Image
from ._sight import LineOfSight
from ._units import Array, expect, image, mapping, number, optional, path_of, refuse, whole

if TYPE_CHECKING:
    import pandas


class Observation:
    """An image to fit, with its noise and PSF.

    Parameters
    ----------
    data_e_s : array_like, shape (n, n)
        Flux per pixel, (y, x), e⁻/s.
    pixel_scale_arcsec, background_rms_e_s, exposure_s : float
        Width of a pixel; standard deviation of the background per pixel, e⁻/s; exposure time, s.
    psf_fwhm_arcsec, psf_truncation_sigma : float
        A Gaussian PSF; 0 for none.
    psf_kernel : array_like, shape (m, m), optional
        A kernel instead, m odd, on pixels ``psf_oversampling`` times as fine.
    mask : array_like, shape (n, n), optional
        1 or True where a pixel is used.
    z_lens : float, optional
        Redshift of the lens, for models made of haloes.
    """

    def __init__(
        self,
        data_e_s: Any,
        *,
        pixel_scale_arcsec: float,
        background_rms_e_s: float,
        exposure_s: float,
        psf_fwhm_arcsec: float = 0.0,
        psf_truncation_sigma: float = 5.0,
        psf_kernel: Any = None,
        psf_oversampling: int = 1,
        mask: Any = None,
        z_lens: float | None = None,
    ) -> None:
        kernel = None
        if psf_kernel is not None:
            kernel = (image("psf_kernel", psf_kernel), whole("psf_oversampling", psf_oversampling, 1, 64))
        self._native = _Observation.of_arrays(
            image("data_e_s", data_e_s),
            number("pixel_scale_arcsec", pixel_scale_arcsec, "arcsec"),
            number("background_rms_e_s", background_rms_e_s),
            number("exposure_s", exposure_s, "s"),
            number("psf_fwhm_arcsec", psf_fwhm_arcsec, "arcsec"),
            number("psf_truncation_sigma", psf_truncation_sigma),
            kernel,
            None if mask is None else image("mask", _numbers(mask)),
            optional("z_lens", z_lens),
        )

    @classmethod
    def read(cls, path: str | os.PathLike[str]) -> Observation:
        """Read a FITS image with the keywords and extensions that ``haloray fit`` reads."""
        found = cls.__new__(cls)
        found._native = _Observation.read(path_of("path", path))
        return found

    @classmethod
    def from_lenstronomy(cls, kwargs_data: Mapping[str, Any], kwargs_psf: Mapping[str, Any]) -> Observation:
        """Of lenstronomy's ``ImageData`` and ``PSF`` keywords.

        Parameters
        ----------
        kwargs_data : mapping
            ``image_data`` (e⁻/s), ``background_rms``, ``exposure_time`` (a number), ``transform_pix2angle`` (a positive number
            times the unit matrix); ``ra_at_xy_0``, ``dec_at_xy_0`` of an image about the axis; ``likelihood_mask``.
        kwargs_psf : mapping
            ``psf_type`` GAUSSIAN (``fwhm``, ``truncation``), PIXEL (``kernel_point_source``,
            ``point_source_supersampling_factor``) or NONE.

        Raises
        ------
        InputError
            A keyword that is missing, or whose effect haloray does not have: noise maps, exposure maps, rotated or
            off-centre grids.
        """
        kwargs_data = mapping("kwargs_data", kwargs_data, "a dictionary")
        kwargs_psf = mapping("kwargs_psf", kwargs_psf, "a dictionary")
        known = {"image_data", "background_rms", "exposure_time", "transform_pix2angle", "likelihood_mask"}
        known |= {"ra_at_xy_0", "dec_at_xy_0"}
        _check_keywords("kwargs_data", kwargs_data, known, {"image_data", "background_rms", "exposure_time"})
        data = image("image_data", kwargs_data["image_data"])
        transform = kwargs_data.get("transform_pix2angle", [[1.0, 0.0], [0.0, 1.0]])
        (xx, xy), (yx, yy) = transform
        if xy != 0.0 or yx != 0.0 or xx != yy or xx <= 0.0:
            raise refuse("transform_pix2angle", transform, "a positive number times the unit matrix")
        corner = -0.5 * (len(data) - 1) * xx
        for name in ("ra_at_xy_0", "dec_at_xy_0"):
            at = number(name, kwargs_data.get(name, corner), "arcsec")
            if abs(at - corner) > 1e-9 * len(data):
                raise refuse(name, at, f"{corner:g}: the image is about the axis")
        kind = kwargs_psf.get("psf_type", "NONE")
        options: dict[str, Any] = {}
        if kind == "GAUSSIAN":
            _check_keywords("kwargs_psf", kwargs_psf, {"psf_type", "fwhm", "truncation", "pixel_size"}, {"fwhm"})
            options = {
                "psf_fwhm_arcsec": kwargs_psf["fwhm"],
                "psf_truncation_sigma": kwargs_psf.get("truncation", 5.0),
            }
        elif kind == "PIXEL":
            kernel = {"kernel_point_source"}
            allowed = kernel | {"psf_type", "point_source_supersampling_factor"}
            _check_keywords("kwargs_psf", kwargs_psf, allowed, kernel)
            options = {
                "psf_kernel": kwargs_psf["kernel_point_source"],
                "psf_oversampling": kwargs_psf.get("point_source_supersampling_factor", 1),
            }
        elif kind != "NONE":
            raise refuse("psf_type", kind, '"GAUSSIAN", "PIXEL" or "NONE"')
        return cls(
            data,
            pixel_scale_arcsec=xx,
            background_rms_e_s=kwargs_data["background_rms"],
            exposure_s=number("exposure_time", kwargs_data["exposure_time"], "s"),
            mask=kwargs_data.get("likelihood_mask"),
            **options,
        )

    @property
    def data_e_s(self) -> Array:
        """The image, (y, x), e⁻/s."""
        return self._native.data_e_s

    @property
    def pixel_scale_arcsec(self) -> float:
        """Width of a pixel."""
        return self._native.pixel_scale_arcsec


def _check_keywords(what: str, given: Mapping[str, Any], known: set[str], required: set[str]) -> None:
    for name in given:
        if name not in known and given[name] is not None:
            raise InputError(f"{what} has {name}, but must have only {', '.join(sorted(known))}")
    for name in sorted(required):
        if given.get(name) is None:
            raise InputError(f"{name} of {what} is missing, but must be given")


def _numbers(mask: Any) -> Any:
    import numpy as np

    found = np.asarray(mask)
    return found.astype(np.float64) if found.dtype == np.bool_ else found


@dataclass(frozen=True)
class Parameter:
    """One quantity of a posterior."""

    name: str
    unit: str
    derived: bool
    mean: float
    median: float
    standard_deviation: float
    best_fit: float
    hpd68_low: float
    hpd68_high: float
    bounded: bool
    r_hat: float
    ess_bulk: float
    ess_tail: float


@dataclass(frozen=True)
class Fit:
    """A posterior.

    Attributes
    ----------
    parameters : dict of str to Parameter
        Every fitted or derived quantity.
    posterior : dict of str to ndarray, shape (chains, draws)
        Its draws.
    sample_stats : dict of str to ndarray, shape (chains, draws)
        ``lp``, the log-posterior in latent coordinates, and ``log_likelihood``.
    statistics : dict
        What ``summary.json`` holds besides: ``converged``, ``good_fit``, ``p_value``, ``chi2_reduced``, ``warnings`` …
    model_e_s, normalised_residuals : ndarray, shape (n, n)
        The image of the best fit, e⁻/s, and (data − model)/σ.
    model_toml : str
        The model in full.
    data_e_s : ndarray, shape (n, n)
        The image that was fitted, e⁻/s; NaN where the mask leaves a pixel out.
    pixel_scale_arcsec : float
        Width of a pixel.
    source : dict of str to float
        The first source of the best fit by lenstronomy's names, and its ``amplitude``; empty for other profiles than Sérsic's.
    """

    parameters: dict[str, Parameter]
    posterior: dict[str, Array]
    sample_stats: dict[str, Array]
    statistics: dict[str, Any]
    model_e_s: Array
    normalised_residuals: Array
    model_toml: str
    data_e_s: Array
    pixel_scale_arcsec: float
    source: dict[str, float]

    @property
    def converged(self) -> bool:
        """True if R-hat < 1.01 and ESS > 400 for every quantity."""
        return bool(self.statistics["converged"])

    @property
    def good_fit(self) -> bool:
        """True if the model describes the image."""
        return bool(self.statistics["good_fit"])

    def __repr__(self) -> str:
        verdict = "converged" if self.converged else "not converged"
        return f"<haloray.Fit: {len(self.parameters)} quantities, {verdict}, good fit: {self.good_fit}>"

    def summary(self) -> str:
        """The posterior as a person reads it."""
        lines = [f"{'parameter':<24} {'median':>11} {'best fit':>11} {'68% interval':>24} {'R-hat':>8} {'ESS':>8}"]
        for own in self.parameters.values():
            interval = f"[{own.hpd68_low:.5f}, {own.hpd68_high:.5f}]"
            edge = "" if own.bounded else "  reaches its prior's edge"
            ess = min(own.ess_bulk, own.ess_tail)
            lines.append(
                f"{own.name:<24} {own.median:>11.5f} {own.best_fit:>11.5f} {interval:>24} {own.r_hat:>8.4f} {ess:>8.0f}{edge}"
            )
        lines += [f"warning: {warning}" for warning in self.statistics["warnings"]]
        verdict = "converged" if self.converged else "NOT CONVERGED"
        describes = "good fit" if self.good_fit else "NOT A GOOD FIT"
        lines.append(f"{verdict}, {describes}: χ²/dof {self.statistics['chi2_reduced']:.3f}")
        return "\n".join(lines)

    def to_dataframe(self) -> pandas.DataFrame:
        """One row a quantity."""
        names = [field.name for field in fields(Parameter)]
        rows = [[getattr(own, name) for name in names] for own in self.parameters.values()]
        frame = package("pandas", "to_dataframe needs pandas").DataFrame(rows, columns=names)
        found: pandas.DataFrame = frame.set_index("name")
        return found

    def to_arviz(self) -> Any:
        """ArviZ's object: ``InferenceData`` of ArviZ 0.x, ``DataTree`` of 1.x (or of ``arviz_base`` alone)."""
        return to_arviz(self.posterior, self.sample_stats)

    def plot_corner(self, names: Any = None, **options: Any) -> Any:
        """The corner plot; see :func:`haloray.figures.corner`."""
        return corner({"": self.posterior}, names, **options)


def to_arviz(posterior: Mapping[str, Array], sample_stats: Mapping[str, Array]) -> Any:
    """ArviZ's object of draws by name: that of 0.x, or of ``arviz_base``, which 1.x reads with and which may stand alone."""
    given = (("posterior", posterior), ("sample_stats", sample_stats))
    groups: dict[str, Any] = {name: dict(own) for name, own in given if own}
    try:
        arviz = package("arviz", "to_arviz needs ArviZ")
    except ImportError:
        arviz = None
    if arviz is not None and arviz.__version__.startswith("0."):
        return arviz.from_dict(**groups)
    return package("arviz_base", "to_arviz needs ArviZ", "arviz").from_dict(groups)


def models() -> list[tuple[str, str]]:
    """List the built-in models.

    Returns
    -------
    list of (str, str)
        The name of each, and what it is for.
    """
    return _haloray.models()


def model_text(name: str) -> str:
    """Show a built-in model in full.

    Parameters
    ----------
    name : str
        One of :func:`models`.

    Returns
    -------
    str
        Its TOML, to be changed and given to :func:`fit`.

    Raises
    ------
    InputError
        No such model.
    """
    return _haloray.model_text(expect("name", name, str, "a model's name"))


#: An image, the path of a FITS file, an Observation, or an Image of :func:`image`.
ObservationLike = Union[Observation, Image, str, "os.PathLike[str]"]


def fit(
    image: ObservationLike,
    model: str | os.PathLike[str] | Mapping[str, Any] = "tidal-minimal",
    *,
    sampler: str = "valley",
    seed: int = 1,
    min_ess: float = 400.0,
    max_draws: int | None = None,
    likelihood: str | None = None,
    pixel_sampling: str | None = None,
    haloes: LineOfSight | None = None,
    z_lens: float | None = None,
    output: str | os.PathLike[str] | None = None,
    overwrite: bool = False,
    resume: str | os.PathLike[str] | None = None,
    progress: Progress = None,
) -> Fit:
    """Fit a lensed image; the start is found from image and priors alone.

    Parameters
    ----------
    image : Observation, Image, or path
        What to fit.
    model : str, path or mapping
        A built-in model (``haloray.models()``), the path of a TOML file, a TOML text, or its sections as dictionaries.
    sampler : {"valley", "nuts", "ensemble-slice", "stretch", "nested"}
        How to sample.
    seed : int
        Seed of everything random.
    min_ess : float
        Effective draws of every quantity before which sampling goes on, at least 400.
    max_draws : int, optional
        Draws of a chain or walker after which sampling stops, converged or not.
    likelihood : {"gaussian", "lenstronomy"}, optional
        Instead of the model's.
    pixel_sampling : {"point", "adaptive"}, optional
        Instead of what the image or the model says.
    haloes : LineOfSight, optional
        Of a model whose line of sight is made of haloes.
    z_lens : float, optional
        Redshift of the lens among those haloes; the image's if left out.
    output : path, optional
        A folder for summary, posterior.nc and figures.
    overwrite : bool
        Whether files there that no earlier fit wrote may be replaced.
    resume : path, optional
        A file for the state of the fit while it is not done. A fit that was stopped, by Ctrl-C or otherwise, goes on from it when
        called again with the same arguments, and ends with the same bits; then the file is removed.
    progress : bool or callable, optional
        See :func:`populate`.

    Raises
    ------
    InputError
        An image, a model or priors that cannot be; ``resume`` names a file that is something else, or of another fit.
    KeyboardInterrupt
        Soon after Ctrl-C.
    """
    if not 400.0 <= number("min_ess", min_ess) < float("inf"):
        raise refuse("min_ess", min_ess, "at least 400 and finite")
    options = SimpleNamespace(
        sampler=expect("sampler", sampler, str, "a sampler's name"),
        seed=whole("seed", seed),
        min_ess=number("min_ess", min_ess),
        max_draws=None if max_draws is None else whole("max_draws", max_draws, 4, 2**31),
        likelihood=None if likelihood is None else expect("likelihood", likelihood, str, "a likelihood's name"),
        pixel_sampling=None if pixel_sampling is None else expect("pixel_sampling", pixel_sampling, str, "a name"),
        output=None if output is None else path_of("output", output),
        overwrite=bool(overwrite),
        resume=None if resume is None else path_of("resume", resume),
    )
    form, text = _description(model)
    through = None
    if haloes is not None:
        sight = expect("haloes", haloes, LineOfSight, "a haloray.LineOfSight")
        through = sight._native, optional("z_lens", z_lens)
    found = _fit(_observation(image)._native, form, text, options, through, callback(progress))
    for complaint in found["complaints"]:
        warnings.warn(complaint, stacklevel=2)
    return fit_of(found)


def fit_of(found: dict[str, Any]) -> Fit:
    """A fit from what the native side has found."""
    statistics = json.loads(found["summary"])
    names = {field.name for field in fields(Parameter)}
    parameters = {
        own["name"]: Parameter(**{name: value for name, value in own.items() if name in names})
        for own in statistics.pop("parameters")
    }
    return Fit(
        parameters,
        found["posterior"],
        found["sample_stats"],
        statistics,
        found["model_e_s"],
        found["normalised_residuals"],
        found["model_toml"],
        found["data_e_s"],
        found["pixel_scale_arcsec"],
        found["source"],
    )


def _observation(image: Any) -> Observation:
    if isinstance(image, Observation):
        return image
    if isinstance(image, Image):
        import tempfile

        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "image.fits")
            image.write(path)
            return Observation.read(path)
    if isinstance(image, (str, os.PathLike)):
        return Observation.read(cast("str | os.PathLike[str]", image))
    raise refuse("image", image, "an Observation, an Image, or the path of a FITS file")


def _description(model: Any) -> tuple[str, str]:
    if isinstance(model, Mapping):
        return "json", as_json("model", cast("Mapping[str, Any]", model))
    if isinstance(model, str) and "\n" in model:
        return "toml", model
    if isinstance(model, (str, os.PathLike)):
        path = path_of("model", cast("object", model))
        if not path.lower().endswith(".toml"):
            return "name", path
        try:
            with open(path, encoding="utf-8") as file:
                return "toml", file.read()
        except FileNotFoundError as error:
            raise MissingFileError(f"cannot read {path}: no such file") from error
        except OSError as error:
            raise FileError(f"cannot read {path}: {error}") from error
        except UnicodeDecodeError as error:
            raise InputError(f"{path} is not a TOML file: not UTF-8 text") from error
    raise refuse("model", model, "a model's name, the path of a TOML file, a TOML text or a dictionary")


__all__ = ["Fit", "Observation", "Parameter", "fit", "model_text", "models", "to_arviz"]
