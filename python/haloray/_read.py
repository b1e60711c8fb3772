"""Reading back what haloray wrote."""

from __future__ import annotations

import os
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from ._config import of_toml
from ._errors import InputError, MissingFileError
from ._fit import to_arviz
from ._haloes import Haloes
from ._haloray import Config, read_groups, read_posterior
from ._observation import Observation
from ._packages import package
from ._units import Array, centred, expect, path_of

if TYPE_CHECKING:
    import xarray


@dataclass(frozen=True, eq=False)
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
        """The draws as ArviZ's object.

        Returns
        -------
        InferenceData or DataTree
            See :meth:`Fit.to_arviz`, in the units of ``units``.

        Raises
        ------
        ImportError
            Without ArviZ.
        """
        return to_arviz(self.posterior, {})

    def to_xarray(self) -> xarray.Dataset:
        """The draws as an xarray data set.

        Returns
        -------
        xarray.Dataset
            With dimensions ``chain`` and ``draw``.
        """
        variables = {
            name: (("chain", "draw"), draws, {"units": self.units[name]} if self.units[name] else {})
            for name, draws in self.posterior.items()
        }
        chains, draws = next(iter(self.posterior.values())).shape if self.posterior else (0, 0)
        found: xarray.Dataset = _xarray().Dataset(variables, {"chain": np.arange(chains), "draw": np.arange(draws)})
        return found


@dataclass(frozen=True, eq=False)
class Run:
    """The ``run.h5`` of a simulation.

    Attributes
    ----------
    groups : dict of str to dict
        Its groups; columns, maps and images by name, (y, x) where square.
    attributes : dict of str to dict
        Numbers and text attached to a group, by its path.
    units : dict of str to str
        Unit of each column, map and image by its path, such as ``haloes/chi_cmpc``.
    config : Config
        What it was made from.
    path : str
        The file.
    """

    groups: dict[str, Any]
    config: Config
    path: str
    attributes: dict[str, dict[str, Any]] = field(default_factory=dict[str, dict[str, Any]])
    units: dict[str, str] = field(default_factory=dict[str, str])

    def setting(self, section: str, key: str) -> float:
        """A number of the configuration, such as ``setting("lens", "einstein_radius_arcsec")``.

        Parameters
        ----------
        section, key : str
            As they stand in the TOML of the run.

        Returns
        -------
        float
            In the unit of its name: arcsec of ``einstein_radius_arcsec``.

        Raises
        ------
        InputError
            No such number.
        """
        return self.config.number(expect("section", section, str, "a name"), expect("key", key, str, "a name"))

    def haloes(self) -> Haloes:
        """The haloes of the run.

        Returns
        -------
        Haloes
            In the order of the file.
        """
        return Haloes.read(self.path, self.config.z_source, self.config.cosmology)

    def maps(self) -> xarray.Dataset:
        """The maps of the run.

        Returns
        -------
        xarray.Dataset
            See :meth:`LineOfSight.maps`.

        Raises
        ------
        KeyError
            A run without maps.
        """
        maps = self.groups["maps"]
        square = {
            name: (("theta_y", "theta_x"), values, {"units": self.units.get(f"maps/{name}", "")})
            for name, values in maps.items()
            if values.ndim == 2
        }
        half = self.setting("maps", "half_width_arcsec")
        axis = np.linspace(-half, half, int(self.setting("maps", "points")))
        coords = {name: (name, axis, {"units": "arcsec"}) for name in ("theta_y", "theta_x")}
        found: xarray.Dataset = _xarray().Dataset(square, coords)
        return found


def read(path: str | os.PathLike[str]) -> Any:
    """Read a ``posterior.nc``, a ``run.h5`` or a FITS image.

    Haloes in a table, which belong to a source, are read by :meth:`Haloes.read`.

    Parameters
    ----------
    path : path
        By its ending .nc, .h5 or .fits.

    Returns
    -------
    Posterior, Run or Observation
        Of a ``posterior.nc``, a ``run.h5``, an image; in the units that their classes say.

    Raises
    ------
    InputError
        A file of another kind, or a damaged one.
    MissingFileError
        No such file.
    """
    name = path_of("path", path)
    suffix = os.path.splitext(name)[1].lower()
    if suffix == ".nc":
        variables = read_posterior(name)
        return Posterior({own: draws for own, _, draws in variables}, {own: unit for own, unit, _ in variables})
    if suffix in (".h5", ".hdf5"):
        groups, toml, attributes, units = read_groups(name)
        if not toml:
            raise InputError(f"{name} holds no configuration, but must be written by haloray")
        return Run(groups, of_toml(toml), name, attributes, units)
    if suffix in (".fits", ".fit", ".fz"):
        return Observation.read(name)
    if not os.path.exists(name):
        raise MissingFileError(f"cannot read {name}: no such file or folder")
    if os.path.isdir(name):
        raise InputError(f"{name} is a folder, but must be one of its files, such as run.h5, posterior.nc, image.fits")
    raise InputError(f"{name} is no .nc, .h5 or .fits file; tables of haloes are read by Haloes.read")


def folder_file(place: str | os.PathLike[str], name: str) -> str:
    """The file of that name in a folder; a path that is no folder is the file itself."""
    path = path_of("path", place)
    return os.path.join(path, name) if os.path.isdir(path) else path


def open_run(path: str | os.PathLike[str]) -> xarray.DataTree:
    """Open a ``run.h5`` (or the folder of a run) as an xarray ``DataTree`` with its groups, units and attributes.

    Parameters
    ----------
    path : path
        The file, or the folder of ``haloray simulate``.

    Returns
    -------
    xarray.DataTree
        Columns of haloes have the dimension ``halo``, maps ``theta_y``, ``theta_x``, images ``y``, ``x`` with coordinates in
        arcsec; other columns a dimension named after their group.

    Raises
    ------
    InputError
        A file of another kind, or a damaged one.
    MissingFileError
        No such file.
    """
    run = read(folder_file(path, "run.h5"))
    if not isinstance(run, Run):
        raise InputError(f"{path} is no run of haloray")
    groups: dict[str, Any] = {}
    _gather(run, "", run.groups, groups)
    groups.setdefault("/", _xarray().Dataset()).attrs["configuration"] = run.config.toml
    tree: xarray.DataTree = _xarray().DataTree.from_dict(groups)
    return tree


def _gather(run: Run, path: str, members: dict[str, Any], groups: dict[str, Any]) -> None:
    about = run.attributes.get(path or "/", {})
    variables: dict[str, Any] = {}
    coords: dict[str, Any] = {}
    for name, values in members.items():
        if isinstance(values, dict):
            _gather(run, f"{path}/{name}".lstrip("/"), cast("dict[str, Any]", values), groups)
            continue
        unit = run.units.get(f"{path}/{name}".lstrip("/"), "")
        own = np.asarray(values)
        dims: tuple[str, ...] = ("halo",) if path == "haloes" else (f"{path.rpartition('/')[2]}_{len(own)}",)
        if own.ndim == 2:
            n = own.shape[0]
            if "half_width_arcsec" in about:
                dims, axis = ("theta_y", "theta_x"), np.linspace(-1.0, 1.0, n) * about["half_width_arcsec"]
            else:
                dims, axis = ("y", "x"), centred(n) * about.get("pixel_scale_arcsec", 1.0)
            coords.update({dim: (dim, axis, {"units": "arcsec"}) for dim in dims})
        variables[name] = (dims, own, {"units": unit} if unit else {})
    groups["/" + path] = _xarray().Dataset(variables, coords, dict(about))


def open_ensemble(path: str | os.PathLike[str], group: str = "sightlines") -> xarray.Dataset:
    """Open a group of a ``sightlines.h5`` (or the folder of an ensemble) as an xarray ``Dataset``.

    Parameters
    ----------
    path : path
        The file, or the folder of ``haloray ensemble``.
    group : {"sightlines", "tidal_haloes", "maps", "images", "lenses", "failures"}
        Which group.

    Returns
    -------
    xarray.Dataset
        With units and words in its attributes.

    Raises
    ------
    InputError
        A file without that group.
    MissingFileError
        No such file.
    """
    name, group = folder_file(path, "sightlines.h5"), expect("group", group, str, "the name of a group")
    if not os.path.exists(name):
        raise MissingFileError(f"cannot read {name}: no such file")
    try:
        found: xarray.Dataset = _xarray().open_dataset(name, group=group, engine="h5netcdf")
        return found
    except OSError as error:
        raise InputError(f"{name} has no group {group!r} of an ensemble: {error}") from error


def open_posterior(path: str | os.PathLike[str]) -> xarray.Dataset:
    """Open a ``posterior.nc`` (or the folder of a fit) as an xarray ``Dataset``.

    Parameters
    ----------
    path : path
        The file, or the folder of ``haloray fit``.

    Returns
    -------
    xarray.Dataset
        With dimensions ``chain`` and ``draw``, units in its attributes.

    Raises
    ------
    InputError
        A file of another kind, or a damaged one.
    MissingFileError
        No such file.
    """
    found = read(folder_file(path, "posterior.nc"))
    if not isinstance(found, Posterior):
        raise InputError(f"{path} is no posterior of haloray")
    return found.to_xarray()


def _xarray() -> Any:
    return package("xarray", "saved results are xarray data sets", "xarray h5netcdf")


__all__ = ["Posterior", "Run", "open_ensemble", "open_posterior", "open_run", "read"]
