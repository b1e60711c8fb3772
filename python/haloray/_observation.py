"""Images to fit."""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import Any

import numpy as np

from ._errors import InputError
from ._haloray import Observation as _Observation
from ._units import Array, image, mapping, number, optional, path_of, refuse, whole


class Observation:
    """An image to fit, with its noise and PSF.

    Its image is ``data_e_s``, its width of a pixel ``pixel_scale_arcsec``.

    Parameters
    ----------
    data_e_s : array_like, shape (n, n)
        Flux per pixel, (y, x), e⁻/s.
    pixel_scale_arcsec, background_rms_e_s, exposure_s : float
        Width of a pixel; standard deviation of the background per pixel, e⁻/s; exposure time, s.
    psf_fwhm_arcsec, psf_truncation_sigma : float
        A Gaussian PSF; 0 for none.
    psf_kernel : array_like, shape (m, m), optional
        A kernel instead, m odd.
    psf_oversampling : int
        How many times as fine the pixels of the kernel are.
    mask : array_like, shape (n, n), optional
        1 or True where a pixel is used.
    z_lens : float, optional
        Redshift of the lens, for models made of haloes.

    Raises
    ------
    InputError
        An image that is not square, numbers outside their domain.
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
        """Read a FITS image with the keywords and extensions that ``haloray fit`` reads.

        Parameters
        ----------
        path : path
            The file.

        Returns
        -------
        Observation
            Image, noise, PSF and mask.

        Raises
        ------
        InputError
            A keyword that is missing, or a damaged file.
        MissingFileError
            No such file.
        """
        found = cls.__new__(cls)
        found._native = _Observation.read(path_of("path", path))
        return found

    @classmethod
    def from_lenstronomy(cls, kwargs_data: Mapping[str, Any], kwargs_psf: Mapping[str, Any]) -> Observation:
        """An observation from lenstronomy's ``ImageData`` and ``PSF`` keywords.

        Parameters
        ----------
        kwargs_data : mapping
            ``image_data`` (e⁻/s), ``background_rms``, ``exposure_time`` (a number), ``transform_pix2angle`` (a positive number
            times the unit matrix); ``ra_at_xy_0``, ``dec_at_xy_0`` of an image about the axis; ``likelihood_mask``.
        kwargs_psf : mapping
            ``psf_type`` GAUSSIAN (``fwhm``, ``truncation``), PIXEL (``kernel_point_source``,
            ``point_source_supersampling_factor``) or NONE.

        Returns
        -------
        Observation
            With the same pixels.

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
        try:
            (xx, xy), (yx, yy) = transform
        except (TypeError, ValueError) as error:
            raise refuse("transform_pix2angle", transform, "a positive number times the unit matrix, (2, 2)") from error
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
            allowed = kernel | {"psf_type", "point_source_supersampling_factor", "pixel_size"}
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

    def __reduce__(self) -> tuple[Any, ...]:
        return _restored, (self._native.state(),)

    def __repr__(self) -> str:
        n = len(self.data_e_s)
        return f"<haloray.Observation: {n} × {n} pixels of {self.pixel_scale_arcsec:g} arcsec>"

    @property
    def data_e_s(self) -> Array:
        """The image, (y, x), e⁻/s."""
        return self._native.data_e_s

    @property
    def pixel_scale_arcsec(self) -> float:
        """Width of a pixel."""
        return self._native.pixel_scale_arcsec


def _restored(state: bytes) -> Observation:
    found = Observation.__new__(Observation)
    found._native = _Observation.of_state(state)
    return found


def _check_keywords(what: str, given: Mapping[str, Any], known: set[str], required: set[str]) -> None:
    for name in given:
        if name not in known and given[name] is not None:
            raise InputError(f"{what} has {name}, but must have only {', '.join(sorted(known))}")
    for name in sorted(required):
        if given.get(name) is None:
            raise InputError(f"{name} of {what} is missing, but must be given")


def _numbers(mask: Any) -> Any:
    found = np.asarray(mask)
    return found.astype(np.float64) if found.dtype == np.bool_ else found
