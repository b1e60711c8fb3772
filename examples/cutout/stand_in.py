"""Makes drizzled.fits, a stand-in for an HST mosaic: a lens behind haloes, a neighbour, a star and sky, in e⁻/s."""

import haloray as hr
import numpy as np
from astropy.io import fits
from astropy.wcs import WCS
from numpy.typing import NDArray

settings = {
    "haloes": {"min_point_shear": 3e-5},
    "image": {"pixels": 72, "pixel_sampling": "point"},
    "instrument": {"psf_fwhm_arcsec": 0.16},
    "source": {"magnitude": 22.5, "radius_arcsec": 0.25, "sersic_index": 1.0},
    "lens_light": {"magnitude": 20.0, "radius_arcsec": 0.8, "sersic_index": 2.0},
}
lens = hr.image(settings, preset="consistent", seed=6).noisy_e_s

rng = np.random.default_rng(1)
mosaic = rng.normal(0.0, 0.0059, (200, 200))
mosaic[64:136, 54:126] = lens
y, x = np.indices((200, 200))


def spot(x0: float, y0: float, flux: float, fwhm_pixels: float) -> NDArray[np.float64]:
    shape: NDArray[np.float64] = np.exp(-4 * np.log(2) * ((x - x0) ** 2 + (y - y0) ** 2) / fwhm_pixels**2)
    return flux * shape / float(shape.sum())


mosaic += spot(160.0, 150.0, 300.0, 2.0) + spot(109.0, 118.0, 2.0, 4.0) + 0.05  # star, neighbour, sky

wcs = WCS(naxis=2)
wcs.wcs.ctype = ["RA---TAN", "DEC--TAN"]
wcs.wcs.crval, wcs.wcs.crpix = [150.1, 2.2], [100.5, 100.5]
wcs.wcs.cd = np.array([[-0.08, 0.0], [0.0, 0.08]]) / 3600
header = wcs.to_header()
header["BUNIT"], header["EXPTIME"] = "ELECTRONS/S", 5400.0
fits.PrimaryHDU(mosaic, header).writeto("drizzled.fits", overwrite=True)
