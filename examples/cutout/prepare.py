"""Cuts the lens out of drizzled.fits and writes what `haloray fit` needs: cutout.fits with PSF and mask."""

import numpy as np
from astropy.coordinates import SkyCoord
from astropy.io import fits
from astropy.nddata import Cutout2D
from astropy.stats import sigma_clipped_stats
from astropy.wcs import WCS

with fits.open("drizzled.fits") as hdus:
    mosaic, header = hdus["SCI"].data, hdus["PRIMARY"].header.copy()
    header.update(hdus["SCI"].header)
wcs = WCS(header)

# Sky and noise, from pixels without objects; the sky is taken away.
_, sky, rms = sigma_clipped_stats(mosaic, sigma=3.0)
lens = Cutout2D(mosaic - sky, SkyCoord("10h00m24.053s +2d12m00.0s"), 56, wcs)

# The PSF: a star, odd-sized, centred on its brightest pixel, of sum 1.
star = Cutout2D(mosaic - sky, (160, 150), 15).data
psf = np.clip(star, 0.0, None)

# 1 = use the pixel: not where the neighbour is.
y, x = np.indices((56, 56))
neighbour_x, neighbour_y = lens.to_cutout_position((109, 118))
mask = np.hypot(x - neighbour_x, y - neighbour_y) > 7

primary = fits.PrimaryHDU(lens.data, lens.wcs.to_header())
primary.header["BUNIT"] = "electron/s"
primary.header["EXPTIME"] = header["EXPTIME"]
primary.header["BKGRMS"] = rms
fits.HDUList(
    [primary, fits.ImageHDU(psf / psf.sum(), name="PSF"), fits.ImageHDU(mask.astype(np.uint8), name="MASK")]
).writeto("cutout.fits", overwrite=True)
print(f"sky {sky:.4f} e-/s, rms {rms:.4f} e-/s, {mask.sum()} of {mask.size} pixels")
