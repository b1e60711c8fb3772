"""Halo tables as astropy, h5py and pandas write them, all the same three haloes as haloes_trailing_comma.csv.

Versions: astropy 8.0.2, h5py 3.16.0, numpy 2.4.6, pandas 3.1.1; 2026-11-25.
Command: python3 data/inputs/make_tables.py
The others here were not made by this script: haloes_unit_deg.*, haloes_trailing_comma.csv, points.csv, and damaged HDF5 files.
"""

from pathlib import Path

import astropy.units as u
import h5py
import numpy as np
from astropy.table import QTable, Table

HERE = Path(__file__).parent
haloes = Table.read(HERE / "haloes_unit_deg.fits")
in_degrees = QTable({name: haloes[name].data for name in haloes.colnames})
for name in haloes.colnames[1:]:
    in_degrees[name].unit = u.arcsec if name in ("r_s_arcsec", "alpha_rs_arcsec") else u.deg
in_degrees["name"] = ["a", "b", "c"]

in_degrees.write(HERE / "astropy.h5", path="haloes", serialize_meta=True, overwrite=True)
in_degrees.write(HERE / "astropy.ecsv", overwrite=True)
in_degrees.write(HERE / "astropy_comma.ecsv", delimiter=",", overwrite=True)
in_degrees.write(HERE / "astropy.fits", overwrite=True)

plain = np.array(Table(in_degrees)["z", "theta_x_arcsec", "theta_y_arcsec", "r_s_arcsec", "alpha_rs_arcsec"])
with h5py.File(HERE / "h5py_records.h5", "w") as file:
    records = file.create_dataset("catalogue", data=plain)
    records.attrs["units"] = ["", "deg", "deg", "arcsec", "arcsec"]
with h5py.File(HERE / "h5py_columns.h5", "w", libver="latest") as file:
    group = file.create_group("haloes")
    for name in plain.dtype.names:
        data = plain[name].astype(">f8" if name == "z" else "<f8")
        column = group.create_dataset(name, data=data, chunks=(2,), compression="gzip", shuffle=True, fletcher32=True)
        if name.startswith("theta"):
            column.attrs["units"] = np.bytes_("degree")

arcsec = Table(plain)
for name in ("theta_x_arcsec", "theta_y_arcsec"):
    arcsec[name] = arcsec[name] * 3600.0
arcsec.to_pandas().to_csv(HERE / "pandas.csv")
