"""The native half: float64 columns, names and numbers in; arrays out."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Protocol, TypeAlias, final

import numpy as np
from numpy.typing import NDArray

_Array: TypeAlias = NDArray[np.float64]
_Progress: TypeAlias = Callable[[str, int, int | None, str], object] | None

__version__: str
git_revision: str
lens_model_names: list[str]

class _Way(Protocol):
    @property
    def z_from(self) -> float | None: ...
    @property
    def z_to(self) -> float | None: ...
    @property
    def lens(self) -> tuple[float, str, dict[str, float]] | None: ...
    @property
    def accuracy_arcsec(self) -> float | str: ...

@final
class Config:
    """A resolved configuration: every key has its value."""

    @staticmethod
    def of_file(preset_name: str, path: str | None) -> Config: ...
    @staticmethod
    def of_text(preset_name: str, text: str) -> Config: ...
    @staticmethod
    def of_json(preset_name: str, json: str) -> Config: ...
    @staticmethod
    def of_complete_text(text: str) -> Config: ...
    def with_options(
        self, seed: int | None = None, draw: str | None = None, accuracy_arcsec: float | str | None = None
    ) -> Config: ...
    @property
    def toml(self) -> str: ...
    @property
    def seed(self) -> int: ...
    @property
    def z_lens(self) -> float: ...
    @property
    def z_source(self) -> float: ...
    @property
    def background_rms_e_s(self) -> float: ...
    def number(self, section: str, key: str) -> float: ...
    @property
    def cosmology(self) -> tuple[float, float]: ...
    @property
    def sheets(self) -> str: ...
    @property
    def reference(self) -> str: ...
    @property
    def accuracy_arcsec(self) -> float | None: ...

@final
class Catalogue:
    """Haloes that nothing changes any more."""

    @staticmethod
    def of_columns(
        z_source: float,
        cosmology: tuple[float, float],
        columns: Mapping[str, _Array],
        text_columns: Mapping[str, Sequence[str]],
    ) -> Catalogue: ...
    @staticmethod
    def read(
        path: str, z_source: float, cosmology: tuple[float, float]
    ) -> tuple[Catalogue, tuple[str, str] | None]: ...
    def write(self, path: str, seed: int | None, config_toml: str) -> None: ...
    def __len__(self) -> int: ...
    @property
    def z_source(self) -> float: ...
    @property
    def cosmology(self) -> tuple[float, float]: ...
    def names(self) -> list[str]: ...
    def text_columns(self) -> dict[str, list[str]]: ...
    def column(self, name: str) -> _Array | None: ...
    def select(self, keep: Sequence[bool]) -> Catalogue: ...
    def effects(self, theta_e_arcsec: float) -> dict[str, _Array]: ...

@final
class Sight:
    """Haloes sorted into planes."""

    def __new__(cls, haloes: Catalogue, sheets: str, reference: str) -> Sight: ...
    def __len__(self) -> int: ...
    def sheet_convergence(self) -> float: ...
    def trace(
        self, x: _Array, y: _Array, way: _Way, order_number: int, progress: _Progress = None
    ) -> tuple[_Array, _Array, _Array | None, _Array | None]: ...
    def delay_days(self, x: _Array, y: _Array, way: _Way) -> _Array: ...
    def effective(self, z_lens: float) -> dict[str, float]: ...
    def maps(self, points: int, half_width_arcsec: float, way: _Way, progress: _Progress = None) -> dict[str, Any]: ...

_Kwargs: TypeAlias = Sequence[Mapping[str, Any]]

@final
class Lens:
    """A list of profiles, and where their planes are."""

    def __new__(
        cls,
        names: Sequence[str],
        z_lens: float | None,
        z_source: float | None,
        lens_redshift_list: Sequence[float] | None,
        cosmology: tuple[float, float],
    ) -> Lens: ...
    def ray(self, x: float, y: float, kwargs: _Kwargs, only: Sequence[int] | None) -> tuple[float, float]: ...
    def trace(
        self, x: _Array, y: _Array, kwargs: _Kwargs, only: Sequence[int] | None, order_number: int
    ) -> tuple[_Array, _Array, _Array | None, _Array | None]: ...
    def potential(self, x: _Array, y: _Array, kwargs: _Kwargs, only: Sequence[int] | None) -> _Array: ...
    def fermat_potential(
        self, x: _Array, y: _Array, kwargs: _Kwargs, source: tuple[_Array, _Array] | None
    ) -> _Array: ...
    def delay_days(self, x: _Array, y: _Array, kwargs: _Kwargs) -> _Array: ...
    def days_per_arcsec2(self, z_lens: float | None) -> float: ...
    def point_images(
        self, source: tuple[float, float], kwargs: _Kwargs, half_width_arcsec: float
    ) -> dict[str, Any]: ...
    def critical_curves(self, kwargs: _Kwargs, half_width_arcsec: float) -> list[dict[str, Any]]: ...
    def einstein_radius(self, kwargs: _Kwargs, centre: tuple[float, float] | None) -> float | None: ...
    def warnings(self, kwargs: _Kwargs) -> list[str]: ...

@final
class Observation:
    """An image to fit, with its noise and PSF."""

    @staticmethod
    def read(path: str) -> Observation: ...
    @staticmethod
    def of_arrays(
        data_e_s: _Array,
        pixel_scale_arcsec: float,
        background_rms_e_s: float,
        exposure_s: float,
        psf_fwhm_arcsec: float,
        psf_truncation_sigma: float,
        psf_kernel: tuple[_Array, int] | None,
        mask: _Array | None,
        z_lens: float | None,
    ) -> Observation: ...
    @property
    def data_e_s(self) -> _Array: ...
    @property
    def pixel_scale_arcsec(self) -> float: ...

@final
class EnsemblePlan:
    """What an ensemble is to hold; computes any part of it."""

    def __new__(
        cls,
        config: Config,
        lenses: Sequence[tuple[str, float, float, float | None]],
        level: str,
        model: str,
        smoothing_arcsec: Sequence[float],
        first_and_number: tuple[int, int],
    ) -> EnsemblePlan: ...
    def columns(self) -> tuple[list[tuple[str, str, str]], list[tuple[str, str, str]]]: ...
    def stacks(self) -> list[tuple[str, str, str, str, tuple[int, int], float]]: ...
    def compute(self, start: int, end: int, folder: str, progress: _Progress = None) -> dict[str, Any]: ...
    def write(
        self,
        all_haloes: _Array,
        tidal_haloes: _Array,
        stacks: Sequence[NDArray[np.float32]],
        failures: Sequence[tuple[int, str]],
        output: str,
        overwrite: bool,
    ) -> list[str]: ...

def mock(
    preset: str,
    seed: int,
    start: int,
    end: int,
    pixel_sampling: str,
    images: bool,
    perturbers: bool,
    progress: _Progress = None,
) -> dict[str, Any]: ...
def mock_instrument() -> tuple[float, float, float, float, float]: ...
def populate(
    config: Config, imported: Catalogue | None = None, sightline: int = 0, progress: _Progress = None
) -> Catalogue: ...
def image(
    config: Config, haloes: Catalogue | None = None, sightline: int = 0, progress: _Progress = None
) -> dict[str, Any]: ...
def write_image(config: Config, pixels_e_s: _Array, sightline: int, path: str) -> None: ...
def simulate(
    config: Config,
    haloes: Catalogue | None = None,
    sightline: int = 0,
    output: str | None = None,
    overwrite: bool = False,
    progress: _Progress = None,
) -> dict[str, Any]: ...
def fit(
    observation: Observation,
    form: str,
    model: str,
    options: Any,
    haloes: tuple[Sight, float | None] | None = None,
    progress: _Progress = None,
) -> dict[str, Any]: ...
def models() -> list[tuple[str, str]]:
    """Names of the built-in models, and what each is for."""

def model_text(name: str) -> str:
    """The TOML of a built-in model."""

def draw_statistics(draws: _Array) -> tuple[float, float, float]: ...
def read_groups(path: str) -> tuple[dict[str, Any], str, dict[str, dict[str, Any]], dict[str, str]]: ...
def read_posterior(path: str) -> list[tuple[str, str, _Array]]: ...
def set_threads(number: int) -> None:
    """Work from now on has so many threads; 0 means all cores."""

def number_of_threads() -> int:
    """How many threads work."""

def foreign_functions() -> list[str]: ...
def seconds_of_rays(haloes: Catalogue, x: _Array, y: _Array) -> float: ...
