"""xarray opens a sightlines.h5 through both netCDF readers, with coordinates, units and descriptions.

Needs: pip install xarray h5netcdf netcdf4 h5py
Run:   python3 check_sightlines.py sightlines.h5
Units: none
"""

import sys

import numpy
import xarray


def main():
    opened = [xarray.open_dataset(sys.argv[1], group="sightlines", engine=engine) for engine in ("h5netcdf", "netcdf4")]
    for table in opened:
        assert table.sizes == {"sightline": table.sightline.size}
        last = table.sel(sightline=table.sightline[-1])
        assert numpy.isfinite(float(last.gamma1_los))
        for name, column in table.data_vars.items():
            assert column.dims == ("sightline",), name
            assert column.attrs["long_name"] and ("units" in column.attrs), name
    assert opened[0].equals(opened[1])
    print(f"{opened[0].sightline.size} sightlines, {len(opened[0].data_vars)} columns through both readers")


if __name__ == "__main__":
    main()
