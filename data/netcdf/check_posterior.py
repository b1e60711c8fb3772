"""Checks that ArviZ opens a posterior.nc of haloray, through both netCDF readers, and agrees with what is in it.

Needs: pip install arviz==0.22.0 h5netcdf netcdf4 h5py
Run:   python3 check_posterior.py posterior.nc
"""

import sys
import warnings

import arviz
import h5py
import numpy as np

path = sys.argv[1]
with h5py.File(path) as file:
    raw = {name: file["posterior"][name][()] for name in file["posterior"] if name not in ("chain", "draw")}
    stats = {name: file["sample_stats"][name][()] for name in file["sample_stats"] if name not in ("chain", "draw")}
for engine in ("h5netcdf", "netcdf4"):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        data = arviz.from_netcdf(path, engine=engine)
        table = arviz.summary(data)
    assert data.posterior[next(iter(raw))].dims == ("chain", "draw"), data.posterior
    assert list(data.posterior.coords) == ["chain", "draw"]
    for group, values in ((data.posterior, raw), (data.sample_stats, stats)):
        assert set(group.data_vars) == set(values), (engine, set(group.data_vars))
        for name, value in values.items():
            assert np.array_equal(group[name].values, value), (engine, name)
    if "diverging" in stats:
        assert data.sample_stats.diverging.dtype == bool
    print(f"{engine}: {dict(data.posterior.sizes)}")
print(table)
