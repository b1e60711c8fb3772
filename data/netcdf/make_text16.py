"""The HDF5 type of the attribute CLASS = "DIMENSION_SCALE": ASCII of 16 bytes that ends in a null byte.

Needs: pip install h5py
Run:   python3 make_text16.py

The netCDF-4 library takes a dataset for a dimension only if CLASS is of exactly this type. haloray reads the type
from this file, since its HDF5 crate makes only null-padded text.
"""

import pathlib

import h5py
import numpy as np

path = pathlib.Path(__file__).resolve().parent / "text16.h5"
with h5py.File(path, "w", libver="v110") as file:
    text16 = h5py.h5t.C_S1.copy()
    text16.set_size(16)
    text16.set_strpad(h5py.h5t.STR_NULLTERM)
    scalar = h5py.h5s.create(h5py.h5s.SCALAR)
    h5py.h5a.create(file.id, b"CLASS", text16, scalar).write(np.array(b"DIMENSION_SCALE", dtype="S16"))
print(path.name, path.stat().st_size, "bytes")
