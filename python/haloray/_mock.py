"""Mock catalogues: composite lenses drawn at random, and their images."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ._ensemble import Executor
from ._haloray import mock as _mock
from ._haloray import mock_instrument
from ._observation import Observation
from ._packages import package
from ._progress import Progress, callback
from ._units import Array, expect, flag, refuse, whole

if TYPE_CHECKING:
    import astropy.table
    import pandas

#: Systems of a task of an executor unless told otherwise.
CHUNK = 16


@dataclass(frozen=True)
class MockImage:
    """The image of a mock system.

    Attributes
    ----------
    noisy_e_s, noise_free_e_s : ndarray, shape (n, n)
        Flux per pixel, (y, x), e⁻/s, with noise and without.
    source_e_s : ndarray, shape (n, n)
        The lensed source with its perturbers alone, e⁻/s.
    quality : float
        Q = Σ SNR over the pixels where it exceeds 1, lens light left out.
    pixel_scale_arcsec : float
        Width of a pixel.
    """

    noisy_e_s: Array
    noise_free_e_s: Array
    source_e_s: Array
    quality: float
    pixel_scale_arcsec: float

    def observation(self) -> Observation:
        """The image with noise as :func:`fit` takes it.

        Returns
        -------
        Observation
            With noise and PSF of the camera of the mocks.
        """
        scale, background, exposure, fwhm, truncation = mock_instrument()
        return Observation(
            self.noisy_e_s,
            pixel_scale_arcsec=scale,
            background_rms_e_s=background,
            exposure_s=exposure,
            psf_fwhm_arcsec=fwhm,
            psf_truncation_sigma=truncation,
        )


@dataclass(frozen=True)
class Mock:
    """Mock systems, one a row; made by :func:`mock`. ``mock["z_lens"]`` is a column.

    Attributes
    ----------
    columns : dict of str to ndarray, shape (n,)
        Every number that was drawn, by the names of ``catalogue.csv`` of ``haloray mock``.
    units : dict of str to str
        Their units; empty for pure numbers.
    truths : dict of str to ndarray, shape (n,)
        What the parameters of the model ``comprehensive`` would be if it described the systems exactly.
    images : list of MockImage
        The images; empty if none were asked for.
    """

    columns: dict[str, Array]
    units: dict[str, str]
    truths: dict[str, Array]
    images: list[MockImage]

    def __len__(self) -> int:
        return len(self.columns["number"])

    __iter__ = None

    def __getitem__(self, name: str) -> Array:
        return self.columns[name]

    def __repr__(self) -> str:
        return f"<haloray.Mock: {len(self)} systems, {len(self.images)} images>"

    def to_table(self) -> astropy.table.QTable:
        """The systems as an astropy table.

        Returns
        -------
        astropy QTable
            With units, and ``quality`` where there are images.
        """
        units = package("astropy.units", "to_table needs astropy")
        names = {"Msun": "solMass"}
        table: astropy.table.QTable = package("astropy.table", "to_table needs astropy").QTable()
        if self.images:
            table["quality"] = [image.quality for image in self.images]
        for name, values in self.columns.items():
            unit = self.units[name]
            if unit == "mag":
                table[name] = units.Magnitude(values)
            else:
                table[name] = values if not unit else units.Quantity(values, names.get(unit, unit), copy=False)
        return table

    def to_dataframe(self) -> pandas.DataFrame:
        """The systems as a pandas data frame.

        Returns
        -------
        pandas DataFrame
            In the units of ``units``, with ``quality`` where there are images.
        """
        quality = {"quality": [image.quality for image in self.images]} if self.images else {}
        found: pandas.DataFrame = package("pandas", "to_dataframe needs pandas").DataFrame({**quality, **self.columns})
        return found


def mock(
    n: int = 64,
    *,
    preset: str = "paper",
    seed: int = 1,
    pixel_sampling: str = "point",
    images: bool = True,
    perturbers: bool = True,
    first: int = 0,
    executor: Executor | None = None,
    chunk: int | None = None,
    progress: Progress = None,
) -> Mock:
    """Draw realistic composite lenses and image them, with the same bits as ``haloray mock``.

    Lenses are stars (Sérsic, elliptical potential, light that traces them) in an offset elliptical NFW halo, sheared by the
    line of sight, before an elliptical Sérsic source with one to three faint perturbers (Hogg et al. 2023, appendix B).
    System k of a seed is the same whatever is drawn beside it.

    Parameters
    ----------
    n : int
        Number of systems.
    preset : {"paper", "text"}
        Distributions: those of the authors' code, or of the text of the appendix.
    seed : int
        Seed of systems and noise.
    pixel_sampling : {"point", "adaptive"}
        How pixels are integrated.
    images : bool
        Whether to image the systems.
    perturbers : bool
        Whether sources have their perturbers; all else of a system stays.
    first : int
        Number of the first system.
    executor, chunk
        See :func:`ensemble`; 16 systems a task.
    progress : bool or callable, optional
        See :func:`populate`.

    Returns
    -------
    Mock
        One system a row.

    Raises
    ------
    InputError
        An argument outside its domain.

    Examples
    --------
    >>> import haloray as hr
    >>> mock = hr.mock(4, seed=1, images=False)
    >>> bool((mock["einstein_radius_arcsec"] >= 0.5).all())
    True
    """
    count, start, seed = whole("n", n, 1, 1_000_000), whole("first", first, 0, 1 << 40), whole("seed", seed)
    preset = expect("preset", preset, str, '"paper" or "text"')
    rest = str(pixel_sampling), flag("images", images), flag("perturbers", perturbers)
    if executor is None:
        parts: list[dict[str, Any]] = [_mock(preset, seed, start, start + count, *rest, callback(progress))]
    else:
        if not hasattr(executor, "submit"):
            raise refuse("executor", executor, "a concurrent.futures.Executor, or another object with a method submit")
        size = CHUNK if chunk is None else whole("chunk", chunk, 1)
        tell = callback(progress)
        starts = range(start, start + count, size)
        ends = [min(own + size, start + count) for own in starts]
        futures = [executor.submit(_mock, preset, seed, own, end, *rest) for own, end in zip(starts, ends)]
        parts = []
        try:
            for end, future in zip(ends, futures):
                parts.append(future.result())
                if tell is not None:
                    tell("systems", end - start, count, "")
        except BaseException:
            for future in futures:
                future.cancel()
            raise
    return _of_parts(parts)


def _of_parts(parts: list[dict[str, Any]]) -> Mock:
    names = [(name, unit) for name, unit, _ in parts[0]["columns"]]
    columns = {name: np.concatenate([part["columns"][i][2] for part in parts]) for i, (name, _) in enumerate(names)}
    truths = {
        name: np.concatenate([part["truths"][i][1] for part in parts]) for i, (name, _) in enumerate(parts[0]["truths"])
    }
    scale = mock_instrument()[0]
    images = [MockImage(**own, pixel_scale_arcsec=scale) for part in parts for own in part["images"]]
    return Mock(columns, dict(names), truths, images)


__all__ = ["Mock", "MockImage", "mock"]
