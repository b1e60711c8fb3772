"""Haloes of a line of sight: drawn, read, or made from tables."""

from __future__ import annotations

import os
import warnings
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Union, cast

import numpy as np

from ._config import ConfigLike, of_toml
from ._config import config as resolve
from ._cosmology import parameters
from ._errors import InputError
from ._haloray import Catalogue, Config
from ._haloray import populate as _populate
from ._packages import package
from ._progress import Progress, callback
from ._units import Array, column, expect, is_flag, mapping, number, path_of, refuse, whole

if TYPE_CHECKING:
    import astropy.table
    import pandas

#: Units of the columns that mean something, None for numbers without.
UNITS = {
    "z": None,
    "c200c": None,
    "theta_x_arcsec": "arcsec",
    "theta_y_arcsec": "arcsec",
    "r_s_arcsec": "arcsec",
    "alpha_rs_arcsec": "arcsec",
    "r_trunc_arcsec": "arcsec",
    "chi_cmpc": "Mpc",
    "m200c_msun": "solMass",
}

#: Haloes, the path of a table (.csv, .h5, .fits), or columns by name.
HaloesLike = Union["Haloes", str, "os.PathLike[str]", Mapping[str, Any], Any]


class Haloes:
    """NFW haloes between observer and source, one a row, deflections reduced to the source.

    Made by :func:`populate`, :meth:`from_columns`, :meth:`from_table`, :meth:`from_dataframe` and :meth:`read`. Columns are
    read-only float64 arrays on memory that is not copied: ``haloes.z``, or ``haloes["z"]``.

    Attributes
    ----------
    z, chi_cmpc : ndarray, shape (n,)
        Redshift; comoving distance, Mpc.
    theta_x_arcsec, theta_y_arcsec : ndarray, shape (n,)
        Place right of and above the axis, arcsec.
    r_s_arcsec, alpha_rs_arcsec : ndarray, shape (n,)
        NFW scale radius and reduced deflection there, arcsec.
    r_trunc_arcsec, m200c_msun, c200c : ndarray, shape (n,), or None
        Truncation radius, arcsec; mass within 200 times the critical density, solar masses; concentration.
    z_source : float
        Redshift of the source.
    cosmology : tuple of float
        H0 in km/s/Mpc and Ωm of the distances (flat ΛCDM).
    config : Config or None
        The configuration that they were drawn from.
    """

    def __init__(
        self,
        native: Catalogue,
        *,
        config: Config | None = None,
        sightline: int = 0,
        made_for: tuple[str, str] | None = None,
    ) -> None:
        made = "made by populate, read, from_columns, from_table or from_dataframe"
        self._native = expect("haloes", native, Catalogue, made)
        self.config = None if config is None else expect("config", config, Config, "a haloray.Config")
        self.sightline = sightline
        self._made_for = (config.sheets, config.reference) if made_for is None and config is not None else made_for

    @classmethod
    def from_columns(cls, columns: Mapping[str, Any], z_source: float, cosmology: Any = None) -> Haloes:
        """Haloes from columns by name.

        Parameters
        ----------
        columns : mapping of str to array_like
            ``z``, ``theta_x_arcsec``, ``theta_y_arcsec`` and either ``r_s_arcsec``, ``alpha_rs_arcsec`` (reduced to the
            source) or ``m200c_msun``, ``c200c``; ``r_trunc_arcsec`` if haloes are truncated. Quantities are converted.
            Other columns are kept, as numbers where those are exact, else as text.
        z_source : float
            Redshift of the source.
        cosmology : optional
            A ``FlatLambdaCDM`` of astropy, or of colossus, without radiation, or (H0 in km/s/Mpc, Ωm); (67.4, 0.315) if left out.

        Returns
        -------
        Haloes
            In the order of the rows; without those at or behind the source, which do nothing, with a warning.

        Warns
        -----
        UserWarning
            Masses that look like logarithms, concentrations of no halo, positions that look like RA and Dec.

        Raises
        ------
        InputError
            A missing column, or a value outside its domain: which halo, which column, what is allowed.
        """
        numbers: dict[str, Array] = {}
        texts: dict[str, list[str]] = {}
        for name, values in mapping("columns", columns, "columns by name").items():
            if name in UNITS:
                numbers[name] = column(name, _of_objects(values), UNITS[name])
            elif _is_number(own := np.asarray(values)):
                numbers[str(name)] = column(str(name), own)
            else:
                texts[str(name)] = [str(value) for value in own]
        source = number("z_source", z_source)
        _leave_out_behind(source, numbers, texts)
        native = Catalogue.of_columns(source, parameters(cosmology), numbers, texts)
        for doubt in native.doubts():
            warnings.warn(doubt, stacklevel=2)
        return cls(native)

    @classmethod
    def from_table(cls, table: astropy.table.Table, z_source: float, cosmology: Any = None) -> Haloes:
        """Haloes from an astropy table, whose columns may have units.

        Parameters
        ----------
        table : astropy Table
            With the columns of :meth:`from_columns`.
        z_source, cosmology
            See :meth:`from_columns`.

        Returns
        -------
        Haloes
            In the order of the rows; without those at or behind the source, which do nothing, with a warning.

        Raises
        ------
        InputError
            See :meth:`from_columns`.
        """
        columns: dict[str, Any] = {}
        given: Any = table
        if not hasattr(given, "colnames"):
            raise refuse("table", given, "an astropy table")
        of_table = getattr(given, "meta", {}).get("z_source")
        if of_table is not None and "alpha_rs_arcsec" in given.colnames and of_table != number("z_source", z_source):
            raise InputError(
                f"z_source is {z_source}, but must be {of_table}: the table's angles are reduced to that source; "
                "Haloes.to_source reduces them to another"
            )
        for name in given.colnames:
            own = given[name]
            unit = getattr(own, "unit", None)
            columns[name] = own if unit is None or hasattr(own, "to_value") else own.quantity
        return cls.from_columns(columns, z_source, cosmology)

    @classmethod
    def from_dataframe(cls, frame: pandas.DataFrame, z_source: float, cosmology: Any = None) -> Haloes:
        """Haloes from a pandas data frame.

        Parameters
        ----------
        frame : pandas DataFrame
            With the columns of :meth:`from_columns`, in their units.
        z_source, cosmology
            See :meth:`from_columns`.

        Returns
        -------
        Haloes
            In the order of the rows; without those at or behind the source, which do nothing, with a warning.

        Raises
        ------
        InputError
            See :meth:`from_columns`.
        """
        if not (hasattr(frame, "columns") and hasattr(frame, "iloc")):
            raise refuse("frame", frame, "a pandas data frame")
        return cls.from_columns({str(name): frame[name].to_numpy() for name in frame.columns}, z_source, cosmology)

    @classmethod
    def read(cls, path: str | os.PathLike[str], z_source: float, cosmology: Any = None) -> Haloes:
        """Haloes of a table, as the command reads it.

        Parameters
        ----------
        path : path
            A .csv, .h5 or .fits; also the run.h5 of a simulation.
        z_source, cosmology
            See :meth:`from_columns`.

        Returns
        -------
        Haloes
            In the order of the rows; without those at or behind the source, which do nothing, with a warning.

        Raises
        ------
        InputError
            A table that holds no haloes, with line and column; angles that belong to another source.
        MissingFileError
            No such file.
        """
        native, made_for = Catalogue.read(path_of("path", path), number("z_source", z_source), parameters(cosmology))
        return cls(native, made_for=made_for)

    def write(self, path: str | os.PathLike[str]) -> None:
        """Write the table, with the same bytes as ``haloray populate``.

        Parameters
        ----------
        path : path
            Ends in .csv, .h5 or .fits.

        Raises
        ------
        InputError
            Another ending.
        FileError
            A file that cannot be written.
        """
        told = f"# sightline = {self.sightline}\n" if self.sightline else ""
        seed = None if self.config is None else self.config.seed
        toml = "" if self.config is None else told + self.config.toml
        self._native.write(path_of("path", path), seed, toml)

    def __len__(self) -> int:
        return len(self._native)

    def __repr__(self) -> str:
        return f"<haloray.Haloes: {len(self)} haloes before a source at z = {self.z_source}>"

    @property
    def z_source(self) -> float:
        """Redshift of the source."""
        return self._native.z_source

    @property
    def cosmology(self) -> tuple[float, float]:
        """H0 in km/s/Mpc and Ωm of the distances."""
        return self._native.cosmology

    @property
    def colnames(self) -> list[str]:
        """Names of the columns of numbers."""
        return self._native.names()

    def __getattr__(self, name: str) -> Any:
        # Only names that are not found otherwise come here; a copy that is being made has no native half yet.
        if name.startswith("_"):
            raise AttributeError(name)
        found = self._native.column(name)
        if found is None and name not in UNITS:
            raise AttributeError(f"haloes have no column {name}; they have {', '.join(self.colnames)}")
        return found

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *self.colnames]

    def __getitem__(self, key: Any) -> Any:
        """A column by its name, or the haloes of a mask, a slice or an array of places, in their order, as numpy has it."""
        if isinstance(key, str):
            found = self._native.column(key)
            if found is None:
                raise KeyError(f"{key} is no column of haloes that have {', '.join(self.colnames)}")
            return found
        allowed = f"a mask of {len(self)}, a slice or places"
        if key is None or is_flag(key):
            raise refuse("key", key, allowed)
        try:
            places = np.arange(len(self))[key]
        except (IndexError, ValueError) as error:
            raise InputError(f"haloes are chosen by {allowed}: {error}") from error
        if places.ndim > 1:
            raise refuse("key", key, allowed)
        return Haloes(self._native.at(np.atleast_1d(places).tolist()), made_for=self._made_for)

    #: Rows are no objects of their own.
    __iter__ = None

    def __setattr__(self, name: str, value: Any) -> None:
        if name in UNITS:
            raise AttributeError(f"{name} of haloes is read-only; make others by Haloes.from_columns")
        super().__setattr__(name, value)

    def effects(self, theta_e_arcsec: float = 1.0) -> dict[str, Array]:
        """What each halo does alone on the axis.

        Parameters
        ----------
        theta_e_arcsec : float
            The scale of Δ, arcsec.

        Returns
        -------
        dict of ndarray, shape (n,)
            ``kappa``, ``gamma1``, ``gamma2``, ``abs_f``, ``abs_g`` (per arcsec) and ``delta``, the relative variation Δ_h
            of the shear across the scale (Hogg et al. 2023, equation 31).

        Raises
        ------
        InputError
            A scale that is not positive.
        """
        return self._native.effects(number("theta_e_arcsec", theta_e_arcsec, "arcsec"))

    def to_source(self, z_source: float) -> Haloes:
        """Haloes before another source, from their masses; those behind it are left out.

        Parameters
        ----------
        z_source : float
            Redshift of the source.

        Returns
        -------
        Haloes
            With angles reduced to that source, arcsec.

        Raises
        ------
        InputError
            Haloes without ``m200c_msun`` and ``c200c``.
        """
        z_source = number("z_source", z_source)
        if z_source == self.z_source:
            return self
        if self.m200c_msun is None or self.c200c is None:
            raise InputError(
                f"z_source is {z_source}, but must be {self.z_source}: the haloes have angles reduced to that source, "
                "and no m200c_msun, c200c"
            )
        before = self[self.z < z_source]
        left_out = ("r_s_arcsec", "alpha_rs_arcsec", "sheet_kappa")
        columns = {name: before[name] for name in before.colnames if name not in left_out}
        haloes = Haloes.from_columns({**columns, **before._native.text_columns()}, z_source, self.cosmology)
        haloes._made_for = self._made_for
        return haloes

    def to_dict(self) -> dict[str, Any]:
        """Columns by name, in the order of haloray's tables.

        Returns
        -------
        dict of str to ndarray, shape (n,), or list of str
            Numbers in the units of their names; texts.
        """
        return {**{name: self[name] for name in self.colnames}, **self._native.text_columns()}

    def to_table(self) -> astropy.table.QTable:
        """Haloes as an astropy table.

        Returns
        -------
        astropy QTable
            With units; source and cosmology in its ``meta``.
        """
        quantity = package("astropy.units", "to_table needs astropy").Quantity
        about = {"z_source": self.z_source, "H0": self.cosmology[0], "Om0": self.cosmology[1]}
        table: astropy.table.QTable = package("astropy.table", "to_table needs astropy").QTable(meta=about)
        for name, values in self.to_dict().items():
            unit = UNITS.get(name)
            table[name] = values if unit is None else quantity(values, unit, copy=False)
        return table

    def to_dataframe(self) -> pandas.DataFrame:
        """Haloes as a pandas data frame.

        Returns
        -------
        pandas DataFrame
            Numbers in the units of their names.
        """
        found: pandas.DataFrame = package("pandas", "to_dataframe needs pandas").DataFrame(self.to_dict())
        return found

    def __reduce__(self) -> tuple[Any, ...]:
        numbers = {name: np.array(self[name]) for name in self.colnames}
        state = (self.z_source, self.cosmology, numbers, self._native.text_columns())
        toml = None if self.config is None else self.config.toml
        return _restored, (state, toml, self.sightline, self._made_for)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Haloes):
            return NotImplemented
        if (self.z_source, self.cosmology, self.colnames) != (other.z_source, other.cosmology, other.colnames):
            return False
        texts = self._native.text_columns() == other._native.text_columns()
        return texts and all(np.array_equal(self[name], other[name], equal_nan=True) for name in self.colnames)

    __hash__ = None  # type: ignore[assignment]


def _leave_out_behind(z_source: float, numbers: dict[str, Array], texts: dict[str, list[str]]) -> None:
    """Leave out haloes at or behind the source; columns of other lengths are told of elsewhere."""
    z = numbers.get("z", np.empty(0))
    behind = np.isfinite(z) & (z >= z_source)
    lengths = {len(own) for own in numbers.values()} | {len(own) for own in texts.values()}
    if not behind.any() or lengths != {len(z)}:
        return
    told = f"left out are {behind.sum()} of {len(z)} haloes at or behind the source (z ≥ {z_source:g})"
    warnings.warn(f"{told}: they deflect none of its light", stacklevel=3)
    numbers.update({name: own[~behind] for name, own in numbers.items()})
    texts.update({name: [value for value, out in zip(own, behind) if not out] for name, own in texts.items()})


def _of_objects(values: Any) -> Any:
    """Numbers that pandas keeps as objects, as numbers."""
    if hasattr(values, "unit") or np.asarray(values).dtype.kind != "O":
        return values
    try:
        return np.asarray(values, dtype=np.float64)
    except (TypeError, ValueError):
        return values


def _is_number(values: np.ndarray[Any, Any]) -> bool:
    """Whether a column of a user's own is one of numbers that float64 holds to the last digit."""
    kind = values.dtype.kind
    return kind == "f" or (kind in "iu" and bool(np.all(np.abs(values.astype(np.float64)) <= 2.0**53)))


def _restored(
    state: tuple[float, tuple[float, float], dict[str, Array], dict[str, list[str]]],
    toml: str | None,
    sightline: int,
    made_for: tuple[str, str] | None,
) -> Haloes:
    config = None if toml is None else of_toml(toml)
    return Haloes(Catalogue.of_columns(*state), config=config, sightline=sightline, made_for=made_for)


def as_haloes(haloes: HaloesLike, z_source: float | None, cosmology: Any = None) -> Haloes:
    """Haloes, or what they can be made from, before a source."""
    if isinstance(haloes, Haloes):
        return haloes if z_source is None else haloes.to_source(z_source)
    if z_source is None:
        raise InputError("z_source is missing, but must be given with haloes that are no haloray.Haloes")
    if isinstance(haloes, (str, os.PathLike)):
        return Haloes.read(cast("str | os.PathLike[str]", haloes), z_source, cosmology)
    given: Any = haloes
    if hasattr(given, "colnames"):
        return Haloes.from_table(given, z_source, cosmology)
    if hasattr(given, "columns") and hasattr(given, "iloc"):
        return Haloes.from_dataframe(given, z_source, cosmology)
    if isinstance(given, Mapping):
        return Haloes.from_columns(cast("Mapping[str, Any]", given), z_source, cosmology)
    raise refuse("haloes", haloes, "haloray.Haloes, a table, the path of one, or columns by name")


def populate(
    config: ConfigLike = None,
    *,
    preset: str = "paper",
    seed: int | None = None,
    draw: str | None = None,
    sightline: int = 0,
    haloes: HaloesLike = None,
    progress: Progress = None,
) -> Haloes:
    """Draw the haloes of a line of sight, with the same bits as ``haloray populate``.

    Parameters
    ----------
    config : str, path, mapping or Config, optional
        See :func:`config`.
    preset, seed, draw
        See :func:`config`.
    sightline : int
        Which of the sightlines of the seed.
    haloes : Haloes or table, optional
        Haloes of your own instead of a draw; the configuration's cuts and truncation apply to them.
    progress : bool or callable, optional
        ``True`` for a progress bar, or a function of (task, done, units, message).

    Returns
    -------
    Haloes

    Raises
    ------
    InputError
        A configuration that cannot be; more haloes expected than memory holds.
    KeyboardInterrupt
        Soon after Ctrl-C.

    Examples
    --------
    >>> import haloray as hr
    >>> haloes = hr.populate("paper", seed=1)
    >>> len(haloes)
    34678
    """
    resolved = resolve(config, preset=preset, seed=seed, draw=draw)
    cosmology = resolved.cosmology
    imported = None if haloes is None else as_haloes(haloes, resolved.z_source, cosmology)._native
    sightline = whole("sightline", sightline)
    native = _populate(resolved, imported, sightline, callback(progress))
    return Haloes(native, config=resolved, sightline=sightline)


__all__ = ["Haloes", "HaloesLike", "as_haloes", "populate"]
