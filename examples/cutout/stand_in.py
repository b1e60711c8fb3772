"""Makes drizzled.fits, in the form of a drizzled HST mosaic: a lens behind haloes, a neighbour, a star and sky, in e⁻/s."""

import haloray as hr
import numpy as np
from astropy.io import fits
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

exposure_s, pixel_deg = 5400.0, 0.08 / 3600
primary = fits.Header({"TELESCOP": "HST", "INSTRUME": "WFC3", "FILTER": "F160W", "EXPTIME": exposure_s})
sci = fits.Header({"BUNIT": "ELECTRONS/S", "CTYPE1": "RA---TAN", "CTYPE2": "DEC--TAN"})
sci["CRVAL1"], sci["CRVAL2"] = 150.1, 2.2
sci["CRPIX1"] = sci["CRPIX2"] = 100.5
sci["CD1_1"], sci["CD1_2"], sci["CD2_1"], sci["CD2_2"] = -pixel_deg, 0.0, 0.0, pixel_deg
fits.HDUList(
    [
        fits.PrimaryHDU(header=primary),
        fits.ImageHDU(mosaic, sci, name="SCI"),
        fits.ImageHDU(np.full_like(mosaic, exposure_s), name="WHT"),
    ]
).writeto("drizzled.fits", overwrite=True)
