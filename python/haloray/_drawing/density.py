"""Smoothed densities of draws, and what is told of them.

Gaussian kernels with the widths of Scott (1992, Multivariate Density Estimation), in two dimensions with the shape of the
draws' covariance. Beyond an end where draws are few the density runs out; near one where they are many they are mirrored.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from .._haloray import draw_statistics
from .._units import Array

CURVE_NODES, FIELD_NODES, KERNEL_REACH, WIDENING = 256, 128, 4.0, 1.2


@dataclass(frozen=True)
class _Spread:
    low: float
    high: float
    mean: float
    deviation: float

    @classmethod
    def of(cls, values: Array, width: float) -> _Spread | None:
        if len(values) < 2 or np.ptp(values) <= 1e-13 * np.abs(values).max():
            return None
        deviation = float(values.std())
        peak = len(values) * width / np.sqrt(2.0 * np.pi)

        def beyond(end: float) -> float:
            near = np.count_nonzero(np.abs(values - end) < width * deviation)
            return KERNEL_REACH * width * deviation if near < 0.25 * peak else 0.0

        low, high = float(values.min()), float(values.max())
        return cls(low - beyond(low), high + beyond(high), float(values.mean()), deviation)

    def unit(self, values: Array) -> Array:
        return (values - self.mean) / self.deviation


def curve(draws: Any) -> tuple[Array, Array] | None:
    """The density of one quantity, its peak 1; none of fewer than two different values."""
    values = np.asarray(draws, dtype=np.float64).ravel()
    values = values[np.isfinite(values)]
    width = WIDENING * max(len(values), 1) ** -0.2
    spread = _Spread.of(values, width)
    if spread is None:
        return None
    counts, edges = np.histogram(values, CURVE_NODES, (spread.low, spread.high))
    smooth = _smoothed(counts.astype(np.float64), width * spread.deviation / (edges[1] - edges[0]))
    return 0.5 * (edges[1:] + edges[:-1]), smooth / smooth.max()


def field(x: Any, y: Any, fractions: tuple[float, ...]) -> tuple[Array, Array, Array, list[float]] | None:
    """The density of two quantities on a grid, and the levels that enclose the given fractions of it."""
    both = np.stack([np.asarray(x, dtype=np.float64).ravel(), np.asarray(y, dtype=np.float64).ravel()])
    x, y = both[:, np.isfinite(both).all(axis=0)]
    width = WIDENING * max(len(x), 1) ** (-1.0 / 6.0)
    along_x, along_y = _Spread.of(x, width), _Spread.of(y, width)
    if along_x is None or along_y is None:
        return None
    correlation = float(np.clip(np.mean(along_x.unit(x) * along_y.unit(y)), -0.9999, 0.9999))

    def white(x: Array, y: Array) -> tuple[Array, Array]:
        u = along_x.unit(x)
        return u, (along_y.unit(y) - correlation * u) / np.sqrt(1.0 - correlation**2)

    reach = KERNEL_REACH * width
    u, v = white(x, y)
    half = float(max(np.abs(u).max(), np.abs(v).max())) + reach
    # Mirrored along the ridge, so that a ridge runs straight on behind the end.
    slope = correlation * along_y.deviation / along_x.deviation
    inverse = correlation * along_x.deviation / along_y.deviation
    counts = np.zeros((FIELD_NODES, FIELD_NODES))
    for image_x, own in _images(along_x, x, reach):
        along = y[own] + slope * (image_x - x[own])
        for image_y, other in _images(along_y, along, reach):
            u, v = white(image_x[other] + inverse * (image_y - along[other]), image_y)
            counts += np.histogram2d(v, u, FIELD_NODES, ((-half, half), (-half, half)))[0]
    step = 2.0 * half / FIELD_NODES
    for _ in range(2):
        counts = np.stack([_smoothed(row, width / step) for row in counts]).T
    nodes_x, nodes_y = (np.linspace(own.low, own.high, FIELD_NODES) for own in (along_x, along_y))
    u, v = white(*np.meshgrid(nodes_x, nodes_y))
    values = _interpolated(counts, (u + half) / step - 0.5, (v + half) / step - 0.5)
    ranked: Array = np.sort(values.ravel())[::-1]
    sums: Array = np.cumsum(ranked)
    places = [int(np.searchsorted(sums, part * float(sums[-1]))) for part in fractions]
    levels = [float(ranked[min(place, len(ranked) - 1)]) for place in places]
    return nodes_x, nodes_y, values, levels


def interval(draws: Any) -> str:
    """Median and distances to the ends of the 68% highest-density interval, in markup."""
    flat = np.ascontiguousarray(np.asarray(draws, dtype=np.float64).ravel())
    median, low, high = draw_statistics(flat[np.isfinite(flat)])
    up, down = high - median, median - low
    least = max(min(abs(up), abs(down)), 0.05 * max(abs(up), abs(down)))
    if least <= 0.0:
        return f"{median:g}"
    decimals = 1 - int(np.floor(np.log10(least)))
    size = max(abs(median), up)
    exponent = int(np.floor(np.log10(size))) if 0.0 < size < 1e-3 else 0
    digits = max(decimals + exponent, 0)

    def number(value: float) -> str:
        return f"{value * 10.0**-exponent:.{digits}f}".replace("-", "−")

    told = f"{number(median)}^{{{'−' if up < 0 else '+'}{number(abs(up))}}}_{{−{number(abs(down))}}}"
    return told if exponent == 0 else f"{told} × 10^{{{str(exponent).replace('-', '−')}}}"


def _images(spread: _Spread, values: Array, reach: float) -> list[tuple[Array, Any]]:
    """The values and their images behind ends that a kernel crosses, each with the places that they come from."""
    far = reach * spread.deviation
    below = np.flatnonzero((values >= spread.low) & (values - spread.low < far))
    above = np.flatnonzero((values <= spread.high) & (spread.high - values < far))
    every = np.arange(len(values))
    return [(values, every), (2 * spread.low - values[below], below), (2 * spread.high - values[above], above)]


def _smoothed(cells: Array, width: float) -> Array:
    """Convolved with a Gaussian; the cells beyond an end are the mirror image of those before it."""
    reach = int(np.ceil(KERNEL_REACH * width))
    steps = np.arange(-reach, reach + 1, dtype=np.float64)
    kernel: Array = np.exp(-0.5 * (steps / max(width, 1e-3)) ** 2)
    mirrored: Array = np.pad(cells, reach, "symmetric")
    smooth: Any = np.convolve(mirrored, kernel / kernel.sum(), "valid")
    return np.asarray(smooth, dtype=np.float64)


def _interpolated(cells: Array, i: Array, j: Array) -> Array:
    """Bilinear between cells, ``i`` along the second axis; zero outside."""
    left, below = np.floor(i).astype(int), np.floor(j).astype(int)
    inside = (left >= 0) & (left <= FIELD_NODES - 2) & (below >= 0) & (below <= FIELD_NODES - 2)
    left, below = np.where(inside, left, 0), np.where(inside, below, 0)
    s, t = i - left, j - below
    low = (1.0 - s) * cells[below, left] + s * cells[below, left + 1]
    high = (1.0 - s) * cells[below + 1, left] + s * cells[below + 1, left + 1]
    return np.where(inside, (1.0 - t) * low + t * high, 0.0)
