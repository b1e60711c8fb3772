"""Whole runs and single exposures."""

from __future__ import annotations

import json
import os
import tempfile
import warnings
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ._config import ConfigLike
from ._config import config as resolve
from ._haloes import Haloes, HaloesLike, as_haloes
from ._haloray import Config
from ._haloray import image as _image
from ._haloray import simulate as _simulate
from ._haloray import write_image as _write_image
from ._packages import package
from ._progress import Progress, callback
from ._sight import dataset
from ._units import Array, flag, path_of, whole

if TYPE_CHECKING:
    import astropy.io.fits
    import xarray


@dataclass(frozen=True, eq=False)
class Image:
    """An exposure of a lens through a line of sight.

    Attributes
    ----------
    noisy_e_s, noise_free_e_s : ndarray, shape (n, n)
        Flux per pixel, (y, x), e⁻/s, with noise and without.
    pixel_scale_arcsec : float
        Width of a pixel.
    lens_centre_arcsec, source_centre_arcsec : tuple of float
        Where lens and source are, so that haloes make them appear on the axis.
    config : Config
        What it was made from.
    sightline : int
        Which of the sightlines of its seed.
    """

    noisy_e_s: Array
    noise_free_e_s: Array
    pixel_scale_arcsec: float
    lens_centre_arcsec: tuple[float, float]
    source_centre_arcsec: tuple[float, float]
    config: Config
    sightline: int = 0

    @property
    def background_rms_e_s(self) -> float:
        """Standard deviation of the background per pixel, e⁻/s."""
        return self.config.background_rms_e_s

    def write(self, path: str | os.PathLike[str], noise_free: bool = False) -> None:
        """Write the image as FITS that :func:`fit` and ``haloray fit`` read, with the same bytes as ``haloray image``.

        Parameters
        ----------
        path : path
            Where.
        noise_free : bool
            Whether to write the image without noise.

        Raises
        ------
        FileError
            A file that cannot be written.
        """
        pixels = self.noise_free_e_s if noise_free else self.noisy_e_s
        _write_image(self.config, np.ascontiguousarray(pixels).reshape(-1), self.sightline, path_of("path", path))

    def to_hdus(self, noise_free: bool = False) -> astropy.io.fits.HDUList:
        """The image as astropy HDUs, with WCS and the keywords of the exposure.

        Parameters
        ----------
        noise_free : bool
            Whether to take the image without noise.

        Returns
        -------
        astropy HDUList
            The image, (y, x), e⁻/s.

        Raises
        ------
        ImportError
            Without astropy.
        """
        fits = package("astropy.io.fits", "to_hdus needs astropy")
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "image.fits")
            self.write(path, noise_free)
            with fits.open(path, memmap=False, lazy_load_hdus=False) as opened:
                found: astropy.io.fits.HDUList = fits.HDUList([hdu.copy() for hdu in opened])
                return found


@dataclass(frozen=True, eq=False)
class Simulation:
    """A whole run: haloes, images through all of them and through those in the tidal regime, maps, and a summary.

    Attributes
    ----------
    summary : dict
        What ``summary.json`` of ``haloray simulate`` holds.
    haloes : Haloes
        The haloes.
    all_haloes, tidal_haloes : Image
        The images.
    config : Config
        What it was made from.
    """

    summary: dict[str, Any]
    haloes: Haloes
    all_haloes: Image
    tidal_haloes: Image
    config: Config
    _maps: dict[str, Any]

    def maps(self) -> xarray.Dataset:
        """Maps of the distortion by all haloes.

        Returns
        -------
        xarray.Dataset
            See :meth:`LineOfSight.maps`.
        """
        return dataset(self._maps)


def image(
    config: ConfigLike = None,
    *,
    preset: str = "paper",
    seed: int | None = None,
    haloes: HaloesLike = None,
    sightline: int = 0,
    accuracy_arcsec: float | str | None = None,
    progress: Progress = None,
) -> Image:
    """Image the lens and source of a configuration through its haloes, with the same bits as ``haloray image``.

    Parameters
    ----------
    config, preset, seed, accuracy_arcsec
        See :func:`config`.
    haloes : Haloes or table, optional
        Haloes of your own instead of a draw.
    sightline : int
        Which of the sightlines of the seed.
    progress : bool or callable, optional
        See :func:`populate`.

    Returns
    -------
    Image
        With noise and without.

    Raises
    ------
    InputError
        See :func:`populate`.
    KeyboardInterrupt
        Soon after Ctrl-C.
    """
    resolved = resolve(config, preset=preset, seed=seed, accuracy_arcsec=accuracy_arcsec)
    sightline = whole("sightline", sightline)
    return _image_of(_image(resolved, _own(haloes, resolved), sightline, callback(progress)), resolved, sightline)


def simulate(
    config: ConfigLike = None,
    *,
    preset: str = "paper",
    seed: int | None = None,
    haloes: HaloesLike = None,
    sightline: int = 0,
    accuracy_arcsec: float | str | None = None,
    output: str | os.PathLike[str] | None = None,
    overwrite: bool = False,
    progress: Progress = None,
) -> Simulation:
    """Run the whole chain, as ``haloray simulate``.

    Parameters
    ----------
    config, preset, seed, accuracy_arcsec
        See :func:`config`.
    haloes, sightline, progress
        See :func:`image`.
    output : path, optional
        A folder for the files and figures of the run.
    overwrite : bool
        Whether files there that no earlier run wrote may be replaced.

    Returns
    -------
    Simulation
        Haloes, images, maps and summary.

    Raises
    ------
    InputError
        See :func:`populate`.
    FileError
        A folder that cannot be written.
    KeyboardInterrupt
        Soon after Ctrl-C.
    """
    resolved = resolve(config, preset=preset, seed=seed, accuracy_arcsec=accuracy_arcsec)
    sightline = whole("sightline", sightline)
    folder = None if output is None else path_of("output", output)
    own = _own(haloes, resolved)
    found = _simulate(resolved, own, sightline, folder, flag("overwrite", overwrite), callback(progress))
    _complain(found)
    return Simulation(
        json.loads(found["summary"]),
        Haloes(found["haloes"], config=resolved, sightline=sightline),
        _image_of(found["all_haloes"], resolved, sightline),
        _image_of(found["tidal_haloes"], resolved, sightline),
        resolved,
        found["maps"],
    )


def _own(haloes: HaloesLike, config: Config) -> Any:
    return None if haloes is None else as_haloes(haloes, config.z_source, config.cosmology)._native


def _image_of(found: dict[str, Any], config: Config, sightline: int) -> Image:
    return Image(
        found["noisy_e_s"],
        found["noise_free_e_s"],
        found["pixel_scale_arcsec"],
        found["lens_centre_arcsec"],
        found["source_centre_arcsec"],
        config,
        sightline,
    )


def _complain(found: dict[str, Any]) -> None:
    for complaint in found["complaints"]:
        warnings.warn(complaint, stacklevel=3)


__all__ = ["Image", "Simulation", "image", "simulate"]
