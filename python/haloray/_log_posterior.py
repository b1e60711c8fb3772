"""The density that a fit samples, for samplers of other packages."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from ._errors import InputError
from ._fit import ObservationLike, prepared
from ._haloray import LogPosterior as _LogPosterior
from ._progress import Progress, callback
from ._sight import LineOfSight
from ._units import Array, array, mapping, number


@dataclass(frozen=True, eq=False)
class Mode:
    """A maximum of a posterior.

    Attributes
    ----------
    latent : ndarray, shape (n,)
        Latent coordinates.
    log_density : float
        ln p there.
    metric : ndarray, shape (n, n)
        Fisher matrix of the latent coordinates plus the unit matrix of the prior; the inverse of the covariance of the normal posterior
        about the maximum.
    """

    latent: Array
    log_density: float
    metric: Array


class LogPosterior:
    """The density that :func:`fit` samples, for samplers of other packages.

    Coordinates are *latent*, dimensionless: a parameter is F⁻¹(Φ(z)), with F the distribution function of its prior and Φ the
    standard normal one. The prior of z is N(0, 1), ln p(z) = ln L(z) − ½|z|², and u = Φ(z) are the coordinates of the unit cube. Nothing has
    an edge. Amplitudes of the lights are marginalised.

    To make it the maxima are found blindly, as by :func:`fit`, in seconds; integrated pixels are refined about them. All points of
    a call are computed on all threads: hand over many. Results do not depend on how many. It cannot be pickled, as the processes of a
    pool would need; there is no need of them.

    Parameters
    ----------
    image, model, seed, likelihood, pixel_sampling, haloes, z_lens, progress
        Those of :func:`fit`.

    Attributes
    ----------
    names : tuple of str
        The free parameters, in the order of the coordinates.
    quantities : dict of str to str
        The unit of every quantity that :meth:`values` computes, parameters first; empty for pure numbers.
    modes : tuple of Mode
        The highest maximum, and others within 3 in ln p and apart from it: where chains should start.
    evaluations : int
        Evaluations of the likelihood that they took.

    Raises
    ------
    InputError
        An image, a model or priors that cannot be.
    KeyboardInterrupt
        Soon after Ctrl-C.

    Examples
    --------
    With emcee, all walkers at once::

        target = hr.LogPosterior("image.fits", "tidal-minimal")
        start = target.modes[0].latent + 0.01 * rng.normal(size=(100, len(target.names)))
        sampler = emcee.EnsembleSampler(100, len(target.names), target, vectorize=True)
        sampler.run_mcmc(start, 1000)
        gamma1 = target.values(sampler.get_chain(flat=True))["gamma1_los"]
    """

    def __init__(
        self,
        image: ObservationLike,
        model: str | os.PathLike[str] | Mapping[str, Any] = "tidal-minimal",
        *,
        seed: int = 1,
        likelihood: str | None = None,
        pixel_sampling: str | None = None,
        haloes: LineOfSight | None = None,
        z_lens: float | None = None,
        progress: Progress = None,
    ) -> None:
        given = prepared(
            image, model, seed=seed, likelihood=likelihood, pixel_sampling=pixel_sampling, haloes=haloes, z_lens=z_lens
        )
        self._native = _LogPosterior(*given, callback(progress))
        self.names = tuple(self._native.names())
        self.quantities = dict(self._native.quantities())
        self.modes = tuple(Mode(*mode) for mode in self._native.modes())
        self.evaluations = self._native.evaluations

    def __repr__(self) -> str:
        return f"<haloray.LogPosterior: {len(self.names)} parameters, {len(self.modes)} modes>"

    def __call__(self, latent: Any) -> Any:
        """ln p.

        Parameters
        ----------
        latent : array_like, shape (..., n)
            Points, dimensionless.

        Returns
        -------
        float or ndarray, shape (...)
            ln L(z) − ½|z|²; −∞ where the model cannot be evaluated.

        Raises
        ------
        InputError
            Points that are not finite, or of another dimension.
        """
        points = self._points(latent)
        return _shaped(self._native.log_density(points.reshape(-1)), points.shape[:-1])

    def log_likelihood(self, latent: Any) -> Any:
        """The likelihood alone, ln L, for samplers that have the prior on their own: z = Φ⁻¹(u) of a point u of the unit cube.

        Parameters
        ----------
        latent : array_like, shape (..., n)
            Points, dimensionless.

        Returns
        -------
        float or ndarray, shape (...)
            ln L(z), dimensionless, amplitudes marginalised; −∞ where the model cannot be evaluated.

        Raises
        ------
        InputError
            Points that are not finite, or of another dimension.
        """
        points = self._points(latent)
        return _shaped(self._native.log_likelihood(points.reshape(-1)), points.shape[:-1])

    def gradient(self, latent: Any) -> tuple[Any, Array]:
        """Compute ln p and its gradient, by some four times the work of ln p.

        Parameters
        ----------
        latent : array_like, shape (..., n)
            Points, dimensionless.

        Returns
        -------
        log_density : float or ndarray, shape (...)
            ln p.
        gradient : ndarray, shape (..., n)
            ∂ ln p/∂z, dimensionless; NaN where ln p is −∞.

        Raises
        ------
        InputError
            Points that are not finite, or of another dimension.
        """
        points = self._points(latent)
        found = self._native.gradient(points.reshape(-1)).reshape(-1, 1 + len(self.names))
        return _shaped(found[:, 0].copy(), points.shape[:-1]), found[:, 1:].reshape(points.shape)

    def values(self, latent: Any) -> dict[str, Any]:
        """Every quantity at points.

        Parameters
        ----------
        latent : array_like, shape (..., n)
            Points, dimensionless.

        Returns
        -------
        dict of str to float or ndarray, shape (...)
            The parameters and what follows from them, in the units of ``quantities``.

        Raises
        ------
        InputError
            Points that are not finite, or of another dimension.
        """
        points = self._points(latent)
        found = self._native.values(points.reshape(-1)).reshape(-1, len(self.quantities))
        return {name: _shaped(found[:, i].copy(), points.shape[:-1]) for i, name in enumerate(self.quantities)}

    def latent(self, values: Mapping[str, float]) -> Array:
        """Latent coordinates of parameters.

        Parameters
        ----------
        values : mapping of str to float
            Every free parameter by its name, in the units of ``quantities``.

        Returns
        -------
        ndarray, shape (n,)
            z, dimensionless.

        Raises
        ------
        InputError
            A parameter that is missing, unknown, or outside its prior.
        """
        given = mapping("values", values, "a dictionary of all free parameters")
        unknown, missing = set(given) - set(self.names), [name for name in self.names if name not in given]
        if unknown or missing:
            what = f"lacks {', '.join(missing)}" if missing else f"has {', '.join(sorted(map(str, unknown)))}"
            raise InputError(f"values {what}, but must name {', '.join(self.names)}")
        return self._native.latent([number(name, given[name]) for name in self.names])

    def _points(self, latent: Any) -> Array:
        points = array("latent", latent)
        if points.ndim == 0 or points.shape[-1] != len(self.names):
            raise InputError(f"latent is of shape {points.shape}, but must be (..., {len(self.names)})")
        return points


def _shaped(column: Array, shape: tuple[int, ...]) -> Any:
    return column.reshape(shape) if shape else float(np.squeeze(column))


__all__ = ["LogPosterior", "Mode"]
