"""Reading back what haloray wrote."""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from ._config import _of_toml
from ._errors import InputError
from ._fit import Observation, to_arviz
from ._haloes import Haloes
from ._haloray import Config, read_groups, read_posterior
from ._units import Array

if TYPE_CHECKING:
    import xarray


@dataclass(frozen=True)
class Posterior:
    """The draws of a ``posterior.nc``.

    Attributes
    ----------
    posterior : dict of str to ndarray, shape (chains, draws)
        Draws by name.
    units : dict of str to str
        Units; empty for pure numbers.
    """

    posterior: dict[str, Array]
    units: dict[str, str]

    def to_arviz(self) -> Any:
        """ArviZ's object, see :meth:`Fit.to_arviz`."""
        return to_arviz(self.posterior, {})


@dataclass(frozen=True)
class Run:
    """The ``run.h5`` of a simulation.

    Attributes
    ----------
    groups : dict of str to dict
        Its groups; columns, maps and images by name, (y, x) where square.
    config : Config
        What it was made from.
    path : str
        The file.
    """

    groups: dict[str, Any]
    config: Config
    path: str

    def haloes(self) -> Haloes:
        """The haloes of the run."""
        return Haloes.read(self.path, self.config.z_source, self.config.cosmology)

    def maps(self) -> xarray.Dataset:
        """The maps of the run; see :meth:`LineOfSight.maps`."""
        try:
            import xarray
        except ImportError as error:
            raise ImportError("maps are xarray data sets: pip install xarray") from error
        maps = self.groups["maps"]
        square = {name: (("theta_y", "theta_x"), values) for name, values in maps.items() if values.ndim == 2}
        axis = next((values for name, values in maps.items() if name.startswith("theta") and values.ndim == 1), None)
        coords = {} if axis is None else {"theta_y": axis, "theta_x": axis}
        return xarray.Dataset(square, coords)


def read(path: str | os.PathLike[str]) -> Posterior | Run | Observation:
    """Read a ``posterior.nc``, a ``run.h5`` or a FITS image.

    Haloes in a table, which belong to a source, are read by :meth:`Haloes.read`.

    Raises
    ------
    InputError
        A file of another kind, or a damaged one.
    MissingFileError
        No such file.
    """
    name = os.fspath(path)
    suffix = os.path.splitext(name)[1].lower()
    if suffix == ".nc":
        variables = read_posterior(name)
        return Posterior({own: draws for own, _, draws in variables}, {own: unit for own, unit, _ in variables})
    if suffix in (".h5", ".hdf5"):
        groups, toml = read_groups(name)
        return Run(groups, _of_toml(toml), name)
    if suffix in (".fits", ".fit", ".fz"):
        return Observation.read(name)
    raise InputError(f"{name} is no .nc, .h5 or .fits file; tables of haloes are read by Haloes.read")


__all__ = ["Posterior", "Run", "read"]
