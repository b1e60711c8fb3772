"""Ensembles: many sightlines of a configuration, on whatever executor there is."""

from __future__ import annotations

import os
import tempfile
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol, Union

import numpy as np
from numpy.typing import NDArray

from ._config import ConfigLike, of_toml
from ._config import config as resolve
from ._errors import InputError
from ._haloray import Config, EnsemblePlan
from ._packages import package
from ._progress import Progress, callback
from ._units import Array, centred, column, flag, number, one_of, path_of, refuse, whole

if TYPE_CHECKING:
    import pandas
    import xarray

LEVELS = ("scalars", "maps", "images", "fits")
#: Sightlines of a task unless told otherwise: what follows from the configuration alone is computed once for each task.
CHUNK = 256

#: A table of lenses: columns ``z_lens``, ``z_source``, optionally ``einstein_radius_arcsec`` and ``name``; or one row each.
LensesLike = Union[Mapping[str, Any], Sequence[Mapping[str, Any]], Any]


class Executor(Protocol):
    """What computes: anything with the ``submit`` of ``concurrent.futures.Executor``."""

    def submit(self, fn: Any, /, *args: Any, **kwargs: Any) -> Any:
        """Call ``fn`` with these arguments some time, somewhere; the future's ``result()`` is what it returns."""


@dataclass(frozen=True)
class _Plan:
    """Everything that a sightline depends on beside its number, as it travels between processes."""

    toml: str
    lenses: tuple[tuple[str, float, float, float | None], ...]
    level: str
    model: str
    smoothing_arcsec: tuple[float, ...]
    first: int
    number: int

    def native(self) -> EnsemblePlan:
        config = of_toml(self.toml)
        lenses, smoothing = list(self.lenses), list(self.smoothing_arcsec)
        return EnsemblePlan(config, lenses, self.level, self.model, smoothing, (self.first, self.number))


class Ensemble:
    """Sightlines of a configuration, one a row; made by :func:`ensemble`.

    ``ensemble["gamma1_los"]`` is a column. Failed sightlines have NaN everywhere and 1 in ``failed``.

    Attributes
    ----------
    sightline : ndarray of int, shape (n,)
        The number of each row, as ``haloray simulate --sightline`` and the ``sightline`` of other functions have it.
    columns : dict of str to ndarray, shape (n,)
        What is seen through all haloes; ``units`` and ``descriptions`` say what each is.
    tidal_haloes : dict of str to ndarray, shape (n,)
        What is seen through the haloes in the tidal regime; empty unless there are images.
    maps, images : dict of str to ndarray of float32, shape (n, y, x)
        With level ``"maps"``, the maps of :meth:`LineOfSight.maps`; with ``"images"`` and ``"fits"`` the images, e⁻/s.
    step_arcsec : float
        Distance of the nodes of maps, or of pixels; NaN without.
    failures : dict of int to str
        Why sightlines could not be computed.
    config : Config
        What they were drawn from.
    """

    def __init__(self, plan: _Plan, parts: Sequence[dict[str, Any]]) -> None:
        native = plan.native()
        self._plan, self._native = plan, native
        self.config: Config = of_toml(plan.toml)
        self.level = plan.level
        self.sightline: NDArray[np.int64] = np.arange(plan.first, plan.first + plan.number)
        described = native.columns()
        values = [np.concatenate([part[own] for part in parts], axis=1) for own in ("all_haloes", "tidal_haloes")]
        self._values = values
        own, tidal = ({row[0]: all_[i] for i, row in enumerate(rows)} for rows, all_ in zip(described, values))
        self.columns: dict[str, Array] = own
        self.tidal_haloes: dict[str, Array] = tidal
        self.units: dict[str, str] = {name: unit for name, unit, _ in described[0]}
        self.descriptions: dict[str, str] = {name: words for name, _, words in described[0]}
        specs = native.stacks()
        self._stacks = [_joined([part["stacks"][i] for part in parts]) for i in range(len(specs))]
        self.maps: dict[str, NDArray[np.float32]] = {}
        self.images: dict[str, NDArray[np.float32]] = {}
        self.step_arcsec = specs[0][5] if specs else float("nan")
        for (group, name, unit, words, _, _), stack in zip(specs, self._stacks):
            (self.maps if group == "maps" else self.images)[name] = stack
            self.units[name], self.descriptions[name] = unit, words
        self.failures: dict[int, str] = dict(failure for part in parts for failure in part["failures"])

    def __len__(self) -> int:
        return len(self.sightline)

    def __repr__(self) -> str:
        failed = f", {len(self.failures)} failed" if self.failures else ""
        return f"<haloray.Ensemble: {len(self)} sightlines, level {self.level}, {len(self.columns)} columns{failed}>"

    __iter__ = None

    def __getitem__(self, name: str) -> Any:
        """A column, a map or an image of every sightline."""
        for own in (self.columns, self.maps, self.images):
            if name in own:
                return own[name]
        raise KeyError(name)

    def to_xarray(self, group: str = "sightlines") -> xarray.Dataset:
        """A group as an xarray data set with dimension ``sightline``.

        Parameters
        ----------
        group : {"sightlines", "tidal_haloes", "maps", "images"}
            Columns; columns seen through the haloes in the tidal regime; maps; images. The groups of ``sightlines.h5``.

        Returns
        -------
        xarray.Dataset
            Units and words stand in the attributes; maps and images have coordinates in arcsec.

        Raises
        ------
        InputError
            Another group.
        """
        groups: dict[str, Mapping[str, NDArray[Any]]] = {
            "sightlines": self.columns,
            "tidal_haloes": self.tidal_haloes,
            "maps": self.maps,
            "images": self.images,
        }
        group = one_of("group", group, list(groups))
        coords: dict[str, Any] = {"sightline": self.sightline}
        variables: dict[str, Any] = {}
        for name, values in groups[group].items():
            dims = ("sightline", "y", "x")[: values.ndim]
            attributes = {"units": self.units.get(name, ""), "long_name": self.descriptions.get(name, "")}
            variables[name] = (dims, values, {key: words for key, words in attributes.items() if words})
            if values.ndim == 3:
                for axis, side in (("y", values.shape[1]), ("x", values.shape[2])):
                    places = centred(side) * self.step_arcsec
                    coords[axis] = (axis, places, {"units": "arcsec"})
        about = {"seed": self.config.seed, "level": self.level, "configuration": self.config.toml}
        found: xarray.Dataset = package("xarray", "to_xarray needs xarray").Dataset(variables, coords, about)
        return found

    def to_dataframe(self) -> pandas.DataFrame:
        """The columns as a pandas data frame.

        Returns
        -------
        pandas DataFrame
            With the index ``sightline``, in the units of ``units``.
        """
        own = package("pandas", "to_dataframe needs pandas")
        found: pandas.DataFrame = own.DataFrame(self.columns, index=own.Index(self.sightline, name="sightline"))
        return found

    def write(self, folder: str | os.PathLike[str], overwrite: bool = False) -> None:
        """Write the files and figures of ``haloray ensemble -o``; ``sightlines.h5`` has the same bytes.

        Parameters
        ----------
        folder : path
            Where; files of an earlier run are replaced.
        overwrite : bool
            Whether files there that no earlier run wrote may be replaced too.

        Raises
        ------
        FileError
            A folder that cannot be written.
        """
        stacks = [np.ascontiguousarray(stack) for stack in self._stacks]
        failures = sorted(self.failures.items())
        own, tidal = self._values
        for complaint in self._native.write(own, tidal, stacks, failures, path_of("folder", folder), flag("overwrite", overwrite)):
            warnings.warn(complaint, stacklevel=2)

    def __reduce__(self) -> tuple[Any, ...]:
        part = {
            "all_haloes": self._values[0],
            "tidal_haloes": self._values[1],
            "stacks": self._stacks,
            "failures": sorted(self.failures.items()),
        }
        return Ensemble, (self._plan, [part])


def ensemble(
    config: ConfigLike = None,
    n: int = 100,
    *,
    preset: str = "paper",
    seed: int | None = None,
    draw: str | None = None,
    accuracy_arcsec: float | str | None = None,
    level: str = "scalars",
    model: str = "tidal-minimal",
    lenses: LensesLike = None,
    smoothing_arcsec: Any = (),
    first: int = 0,
    executor: Executor | None = None,
    chunk: int | None = None,
    progress: Progress = None,
) -> Ensemble:
    """Compute many sightlines of a configuration, with the same bits as ``haloray ensemble``.

    Sightline k is the same whatever is computed beside it, in whatever order, process or number of threads.

    Parameters
    ----------
    config, preset, seed, draw, accuracy_arcsec
        See :func:`config`.
    n : int
        How many sightlines; of each lens where there are lenses.
    level : {"scalars", "maps", "images", "fits"}
        How much is computed of each: tensors, flexions, Δ and counts; also maps; also both images and γ_LOS by every
        definition; also γ_LOS as a fit of the image finds it (a minute a sightline).
    model : str
        The built-in model of the fits.
    lenses : mapping of str to array_like, or sequence of mappings, optional
        Columns, or rows, ``z_lens``, ``z_source`` and optionally ``einstein_radius_arcsec``, ``name``. Of L lenses,
        sightline k is one of lens k mod L.
    smoothing_arcsec : array_like
        Radii R of discs about the axis ray over which γ_LOS is averaged too, to first order: columns ``gamma1_los_disc_R``.
    first : int
        Number of the first sightline.
    executor : concurrent.futures.Executor, optional
        Where to compute: a thread or process pool, ``MPIPoolExecutor`` of mpi4py, a dask.distributed ``Client``, or anything
        else with a ``submit``. Without, this process computes, on all its threads.
    chunk : int, optional
        Sightlines of a task of the executor; 256, or fewer where there are few.
    progress : bool or callable, optional
        See :func:`populate`.

    Returns
    -------
    Ensemble

    Raises
    ------
    InputError
        A configuration, a lens or an argument outside its domain; a halo table in the configuration.
    KeyboardInterrupt
        Soon after Ctrl-C; tasks that have not begun are cancelled.

    Notes
    -----
    Processes of a pool share the cores: give each one thread with ``initializer=haloray.set_threads, initargs=(1,)``.

    Examples
    --------
    >>> import haloray as hr
    >>> ensemble = hr.ensemble({"haloes": {"min_point_shear": 1e-4}}, 8, seed=1)
    >>> ensemble["gamma1_los"].shape
    (8,)
    """
    resolved = resolve(config, preset=preset, seed=seed, draw=draw, accuracy_arcsec=accuracy_arcsec)
    level = one_of("level", level, LEVELS)
    rows = _lenses(lenses)
    count = whole("n", n, 1, 1 << 40) * max(len(rows), 1)
    radii = np.unique(column("smoothing_arcsec", smoothing_arcsec, "arcsec"))
    smoothing = tuple(float(radius) for radius in radii)
    plan = _Plan(resolved.toml, rows, level, str(model), smoothing, whole("first", first, 0, 1 << 40), count)
    native = plan.native()
    if executor is None:
        return Ensemble(plan, [_compute(native, plan.first, plan.first + count, callback(progress))])
    if not hasattr(executor, "submit"):
        raise refuse("executor", executor, "a concurrent.futures.Executor, or another object with a method submit")
    size = min(CHUNK, -(-count // 8)) if chunk is None else whole("chunk", chunk, 1)
    tell = callback(progress)
    starts = range(plan.first, plan.first + count, size)
    futures = [executor.submit(_part, plan, start, min(start + size, plan.first + count)) for start in starts]
    parts: list[dict[str, Any]] = []
    try:
        for start, future in zip(starts, futures):
            parts.append(future.result())
            if tell is not None:
                tell("sightlines", min(start + size - plan.first, count), count, "")
    except BaseException:
        for future in futures:
            future.cancel()
        raise
    return Ensemble(plan, parts)


def _part(plan: _Plan, start: int, end: int) -> dict[str, Any]:
    """A task of an executor."""
    return _compute(plan.native(), start, end, None)


def _compute(native: EnsemblePlan, start: int, end: int, tell: Any) -> dict[str, Any]:
    with tempfile.TemporaryDirectory(prefix="haloray-") as folder:
        return native.compute(start, end, folder, tell)


def _joined(stacks: list[NDArray[np.float32]]) -> NDArray[np.float32]:
    return stacks[0] if len(stacks) == 1 else np.concatenate(stacks)


def _lenses(lenses: LensesLike) -> tuple[tuple[str, float, float, float | None], ...]:
    if lenses is None:
        return ()
    given: Any = lenses
    if isinstance(lenses, Mapping):
        table: dict[str, Any] = {str(name): given[name] for name in given}
    elif hasattr(given, "colnames") or hasattr(given, "columns"):
        names = getattr(given, "colnames", None) or list(given.columns)
        table = {str(name): np.asarray(given[name]) for name in names}
    else:
        try:
            table = {name: [row[name] for row in given] for name in dict(given[0])}
        except (TypeError, KeyError, IndexError, ValueError) as error:
            raise refuse("lenses", lenses, "columns by name or rows that all have the same names") from error
    missing = {"z_lens", "z_source"} - set(table)
    if missing:
        raise InputError(f"column {min(missing)} of lenses is missing, but must be given")
    numbers = {name: column(f"{name} of lenses", table[name]) for name in ("z_lens", "z_source")}
    radius = table.get("einstein_radius_arcsec")
    radii = None if radius is None else column("einstein_radius_arcsec of lenses", radius, "arcsec")
    z_lens, z_source = numbers["z_lens"], numbers["z_source"]
    texts = [str(name) for name in table.get("name", range(1, len(z_lens) + 1))]
    lengths = {len(z_lens), len(z_source), len(texts), len(z_lens) if radii is None else len(radii)}
    if lengths != {len(z_lens)} or not len(z_lens):
        raise InputError("columns of lenses differ in length or are empty, but must have one value a lens")
    rows: list[tuple[str, float, float, float | None]] = []
    for i, name in enumerate(texts):
        z = number("z_lens", z_lens[i]), number("z_source", z_source[i])
        if not 0.0 < z[0] < z[1] <= 20.0:
            raise InputError(
                f"lens {name} has z_lens = {z[0]} and z_source = {z[1]}, but must have 0 < z_lens < z_source <= 20"
            )
        if radii is not None and not 0.0 <= radii[i] < float("inf"):
            raise refuse(f"einstein_radius_arcsec of lens {name}", radii[i], "not negative")
        rows.append((name, *z, None if radii is None else float(radii[i])))
    return tuple(rows)


__all__ = ["Ensemble", "Executor", "ensemble"]
