"""Fits: an image and a model to a posterior."""

from __future__ import annotations

import json
import os
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any, Union, cast

from . import _haloray
from ._config import as_json
from ._drawing.corner import corner
from ._errors import FileError, InputError, MissingFileError
from ._haloray import fit as _fit
from ._observation import Observation
from ._packages import package
from ._progress import Progress, callback
from ._run import Image
from ._sight import LineOfSight
from ._units import Array, expect, flag, number, optional, path_of, refuse, whole

if TYPE_CHECKING:
    import pandas


@dataclass(frozen=True)
class Parameter:
    """One quantity of a posterior.

    Attributes
    ----------
    name, unit : str
        Its name, and its unit; empty for pure numbers.
    derived : bool
        Whether it follows from others.
    mean, median, standard_deviation, best_fit : float
        Of the draws; where the posterior is largest.
    hpd68_low, hpd68_high : float
        Ends of the 68% highest-density interval.
    bounded : bool
        False if the draws reach an edge of the prior.
    r_hat, ess_bulk, ess_tail : float
        Split R-hat and effective draws (Vehtari et al. 2021).
    """

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


@dataclass(frozen=True, eq=False)
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
        """The posterior as a person reads it.

        Returns
        -------
        str
            A line a quantity, with the units of ``parameters``, warnings and verdict.
        """
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
        """The parameters as a pandas data frame.

        Returns
        -------
        pandas DataFrame
            One row a quantity, with the index ``name``.
        """
        names = [field.name for field in fields(Parameter)]
        rows = [[getattr(own, name) for name in names] for own in self.parameters.values()]
        frame = package("pandas", "to_dataframe needs pandas").DataFrame(rows, columns=names)
        found: pandas.DataFrame = frame.set_index("name")
        return found

    def to_arviz(self) -> Any:
        """The draws as ArviZ's object.

        Returns
        -------
        InferenceData or DataTree
            ``InferenceData`` of ArviZ 0.x, ``DataTree`` of 1.x (or of ``arviz_base`` alone), in the units of ``parameters``.

        Raises
        ------
        ImportError
            Without ArviZ.
        """
        return to_arviz(self.posterior, self.sample_stats)

    def plot_corner(self, names: Any = None, **options: Any) -> Any:
        """Draw the corner plot of the draws.

        Parameters
        ----------
        names : sequence of str, optional
            Which quantities; eight unless given, shears first.
        **options
            ``figure`` and ``truths`` of :func:`haloray.figures.corner`.

        Returns
        -------
        matplotlib Figure
            Contours of every pair.

        Raises
        ------
        InputError
            A name that is no quantity of the fit.
        """
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
    profile: Sequence[str] = (),
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
    profile : sequence of str
        Free parameters, ``"gamma1_los"``, whose profile likelihoods ``statistics["profiles"]`` then holds: ``best_fit``,
        ``interval68`` and ``interval95`` (the ends of −2Δln L < 1 and 4, Wilks 1938; None where the prior's edge was reached first),
        ``values`` and ``delta_log_likelihood``.
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

    Returns
    -------
    Fit
        The posterior.

    Raises
    ------
    InputError
        An image, a model or priors that cannot be; ``resume`` names a file that is something else, or of another fit.
    KeyboardInterrupt
        Soon after Ctrl-C.
    """
    if not 400.0 <= number("min_ess", min_ess) < float("inf"):
        raise refuse("min_ess", min_ess, "at least 400 and finite")
    given = prepared(
        image,
        model,
        seed=seed,
        likelihood=likelihood,
        pixel_sampling=pixel_sampling,
        haloes=haloes,
        z_lens=z_lens,
        sampler=expect("sampler", sampler, str, "a sampler's name"),
        min_ess=number("min_ess", min_ess),
        profile=_names(profile),
        max_draws=None if max_draws is None else whole("max_draws", max_draws, 4, 2**31),
        output=None if output is None else path_of("output", output),
        overwrite=flag("overwrite", overwrite),
        resume=None if resume is None else path_of("resume", resume),
    )
    found = _fit(*given, callback(progress))
    for complaint in found["complaints"]:
        warnings.warn(complaint, stacklevel=2)
    return fit_of(found)


def prepared(
    image: ObservationLike,
    model: str | os.PathLike[str] | Mapping[str, Any],
    *,
    seed: int,
    likelihood: str | None,
    pixel_sampling: str | None,
    haloes: LineOfSight | None,
    z_lens: float | None,
    sampler: str = "valley",
    min_ess: float = 400.0,
    profile: Sequence[str] = (),
    max_draws: int | None = None,
    output: str | None = None,
    overwrite: bool = False,
    resume: str | None = None,
) -> tuple[Any, str, str, SimpleNamespace, tuple[Any, float | None] | None]:
    """Image, form and text of the model, options and haloes as the native side takes them."""
    options = SimpleNamespace(
        sampler=sampler,
        seed=whole("seed", seed),
        min_ess=min_ess,
        profile=profile,
        max_draws=max_draws,
        likelihood=None if likelihood is None else expect("likelihood", likelihood, str, "a likelihood's name"),
        pixel_sampling=None if pixel_sampling is None else expect("pixel_sampling", pixel_sampling, str, "a name"),
        output=output,
        overwrite=overwrite,
        resume=resume,
    )
    form, text = _description(model)
    through = None
    if haloes is not None:
        sight = expect("haloes", haloes, LineOfSight, "a haloray.LineOfSight")
        through = sight._native, optional("z_lens", z_lens)
    return _observation(image)._native, form, text, options, through


def _names(profile: object) -> list[str]:
    """Names of parameters, no single one: its letters are no names."""
    if isinstance(profile, str) or not isinstance(profile, Sequence):
        raise refuse("profile", profile, "a sequence of names of free parameters")
    names = cast("Sequence[object]", profile)
    return [expect("profile", name, str, "a parameter's name") for name in names]


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


__all__ = ["Fit", "Parameter", "fit", "model_text", "models", "to_arviz"]
