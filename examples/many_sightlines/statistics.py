import numpy as np
import xarray

sightlines = xarray.open_dataset("ensemble/sightlines.h5", group="sightlines", engine="h5netcdf")
gamma = np.hypot(sightlines.gamma1_los, sightlines.gamma2_los)
print(f"median |gamma_LOS| {float(gamma.median()):.4f}")
print(f"Delta_tot above 0.5: {int((sightlines.delta_tot > 0.5).sum())} of {sightlines.sizes['sightline']}")
print(sightlines.gamma1_los.attrs["long_name"])
