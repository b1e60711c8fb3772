"""slsim's tables of (κ, |γ|): what its populations of lenses draw lines of sight from, by the redshifts of source and lens."""

from __future__ import annotations

import os
import re
from collections.abc import Sequence

import numpy as np

from ._ensemble import Ensemble
from ._errors import FileError, InputError, MissingFileError
from ._haloray import __version__
from ._packages import package
from ._units import Array, expect, flag, items, one_of, path_of, refuse

#: Which columns of an ensemble a table holds: (whether for slsim's tables with the correction, where) to the end of their names.
_COLUMNS = {(True, "axis"): "los", (True, "ring"): "los_ring", (False, "axis"): "os", (False, "ring"): "os_beam"}
_NAME = re.compile(r"zs_(\d+(?:\.\d+)?)(?:_zd_(\d+(?:\.\d+)?))?")


def to_slsim(
    path: str | os.PathLike[str],
    ensembles: Ensemble | Sequence[Ensemble],
    *,
    corrected: bool = True,
    place: str = "axis",
) -> None:
    """Write sightlines as a table of (κ, \\|γ\\|) that slsim draws lines of sight from.

    Parameters
    ----------
    path : path
        The HDF5 file, replaced if it is there. A slsim ``LOSPop`` takes it as ``nonlinear_correction_path`` (with
        ``nonlinear_los_bool=True``), or as ``no_correction_path`` where ``corrected`` is False.
    ensembles : Ensemble or sequence of Ensemble
        Sightlines, of one lens or many. They are filed under the redshifts, in steps of 0.1, under which slsim looks for
        them. Sightlines that failed are left out.
    corrected : bool
        True for κ and \\|γ\\| of A_LOS = A_odᵀ A_ds⁻¹ A_os, by redshifts of source and lens: slsim's tables with the non-linear
        correction. False for those of A_os alone, by the redshift of the source.
    place : {"axis", "ring"}
        Of the ray on the axis, or of averages along the beam of the Einstein ring.

    Raises
    ------
    InputError
        No ensembles, redshifts outside of 0.05 to 4.95 (slsim's tables end there), or another ``place``.
    FileError
        A file that cannot be written.
    ImportError
        Without h5py (``pip install h5py``).

    Notes
    -----
    Each data set ``zs_1.5_zd_0.5`` (``zs_1.5`` without correction) has the shape (n, 2): κ and \\|γ\\| of each sightline,
    dimensionless. slsim 0.1.1 (``slsim.LOS.los_pop.LOSPop``) draws the two independently of each other, and
    the direction of the shear uniformly.
    """
    end = _COLUMNS[flag("corrected", corrected), one_of("place", place, ("axis", "ring"))]
    several = "a haloray.Ensemble, or a list of them"
    given = [ensembles] if isinstance(ensembles, Ensemble) else items("ensembles", ensembles, several)
    if not given:
        raise InputError("ensembles are none, but must be at least one")
    tables: dict[str, list[Array]] = {}
    for one in given:
        own = expect("ensembles", one, Ensemble, several)
        for name, rows in _filed(own, corrected):
            gamma = np.hypot(own[f"gamma1_{end}"][rows], own[f"gamma2_{end}"][rows])
            tables.setdefault(name, []).append(np.stack([own[f"kappa_{end}"][rows], gamma], axis=1))
    _write(path_of("path", path), {name: np.concatenate(parts) for name, parts in sorted(tables.items())})


def from_slsim(path: str | os.PathLike[str]) -> dict[tuple[float, float | None], Array]:
    """Read a table of (κ, \\|γ\\|) of slsim.

    Parameters
    ----------
    path : path
        slsim's ``no_nonlinear_distributions.h5``, ``joint_distributions.h5``, or what :func:`to_slsim` writes.

    Returns
    -------
    dict of (float, float or None) to ndarray, shape (n, 2)
        By redshifts of source and lens (None in tables without correction): κ and \\|γ\\| of each sightline, dimensionless.

    Raises
    ------
    InputError
        A file that is no such table.
    MissingFileError
        No such file.
    ImportError
        Without h5py (``pip install h5py``).
    """
    name = path_of("path", path)
    h5py = package("h5py", "slsim's tables are HDF5 files")
    if not os.path.exists(name):
        raise MissingFileError(f"cannot read {name}: no such file")
    found: dict[tuple[float, float | None], Array] = {}
    try:
        with h5py.File(name, "r") as file:
            for key, values in file.items():
                match = _NAME.fullmatch(key)
                if match is None or getattr(values, "ndim", 0) != 2 or values.shape[1] < 2:
                    raise InputError(
                        f"{name} is no table of slsim: it holds {key}, but must hold zs_…, of shape (n, 2)"
                    )
                redshifts = float(match[1]), None if match[2] is None else float(match[2])
                found[redshifts] = np.asarray(values[:, :2], dtype=np.float64)
    except OSError as error:
        raise InputError(f"{name} is no table of slsim: {error}") from error
    if not found:
        raise InputError(f"{name} is no table of slsim: it is empty")
    return found


def _filed(ensemble: Ensemble, corrected: bool) -> list[tuple[str, Array]]:
    """The name of each table that the ensemble has sightlines for, and which."""
    columns, n = ensemble.columns, len(ensemble)
    z_lens = columns.get("z_lens", np.full(n, ensemble.config.z_lens))
    z_source = columns.get("z_source", np.full(n, ensemble.config.z_source))
    places: dict[str, list[int]] = {}
    for i in np.flatnonzero(columns["failed"] == 0.0):
        places.setdefault(_key(float(z_source[i]), float(z_lens[i]), corrected), []).append(int(i))
    return [(name, np.array(rows)) for name, rows in places.items()]


def _key(z_source: float, z_lens: float, corrected: bool) -> str:
    """Where slsim looks for sightlines of these redshifts: at tenths, and a tenth before the source at least."""
    for name, z in (("z_lens", z_lens), ("z_source", z_source)):
        if not 0.05 <= z <= 4.95:
            raise refuse(f"{name} of the ensemble", z, "from 0.05 to 4.95: slsim's tables end there")
    source, lens = (min(max(round(z * 10) / 10, 0.1), 4.9) for z in (z_source, z_lens))
    if lens == source:
        lens = round(lens - 0.1, 1)
    return f"zs_{source}_zd_{lens}" if corrected else f"zs_{source}"


def _write(path: str, tables: dict[str, Array]) -> None:
    h5py = package("h5py", "slsim's tables are HDF5 files")
    unfinished = f"{path}.part"
    try:
        with h5py.File(unfinished, "w") as file:
            file.attrs["writer"] = f"haloray {__version__}"
            for name, values in tables.items():
                file.create_dataset(name, data=values).attrs["columns"] = ["kappa", "gamma"]
        os.replace(unfinished, path)
    except OSError as error:
        raise FileError(f"cannot write {path}: {error}") from error


__all__ = ["from_slsim", "to_slsim"]
