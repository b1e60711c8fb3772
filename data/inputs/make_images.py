"""image_ok.fits as other programs keep images: in extensions, compressed tiles, other units and WCS keywords.

Versions: astropy 8.0.2, numpy 2.4.6; 2026-11-25.
Command: python3 data/inputs/make_images.py
image_ok.fits, wcs_to_header.fits, psf_half_pixel.fits, blank.fits, gzipped.fits.gz and psffwhm_capacity_overflow.fits were not
made by this script. Truth of all: theta_E 1.2, R_sersic 0.25, n_sersic 1.2.
"""

from pathlib import Path

import numpy as np
from astropy.io import fits

HERE = Path(__file__).parent
with fits.open(HERE / "image_ok.fits") as units:
    data, header = units[0].data.astype("f8"), units[0].header.copy()
EXPOSURE = ["EXPTIME", "BKGRMS", "PSFFWHM"]


def primary(inherited):
    """An empty primary unit with these keywords of the image."""
    unit = fits.PrimaryHDU()
    for name in inherited:
        unit.header[name] = header[name]
    return unit


def science(inherit):
    """The image as an extension SCI without what its primary header says."""
    unit = fits.ImageHDU(data, name="SCI")
    for card in header.cards:
        if card.keyword[:5] in ("CTYPE", "CRPIX", "CDELT", "CUNIT", "CRVAL", "BUNIT"):
            unit.header[card.keyword] = card.value
    if inherit is not None:
        unit.header["INHERIT"] = inherit
    return unit


weight = fits.ImageHDU(np.full(data.shape, 9.0), name="WHT")
error = fits.ImageHDU(np.full(data.shape, 0.01), name="ERR")
flags = fits.ImageHDU(np.zeros(data.shape, "i2"), name="DQ")
for name, inherit in [("sci_inherit.fits", True), ("sci_silent.fits", None), ("sci_alone.fits", False)]:
    fits.HDUList([primary(EXPOSURE), weight, science(inherit), error, flags]).writeto(HERE / name, overwrite=True)
two = [fits.ImageHDU(data, name=name) for name in ("F814W", "F606W")]
fits.HDUList([primary(EXPOSURE), *two]).writeto(HERE / "two_bands.fits", overwrite=True)

STEPS, LOSSLESS = {"quantize_level": -1e-5}, {"quantize_level": 0.0}  # in steps of 1e-5 e-/s, or not in steps
for name, method, type_of_pixels, level in [
    ("rice_1", "RICE_1", "f8", STEPS),
    ("gzip_1", "GZIP_1", "f8", LOSSLESS),
    ("gzip_2", "GZIP_2", "f4", STEPS),
    ("gzip_1_steps", "GZIP_1", "f8", STEPS),
    ("gzip_2_steps", "GZIP_2", "f8", STEPS),
    ("gzip_2_lossless", "GZIP_2", "f8", LOSSLESS),
    ("hcompress_1", "HCOMPRESS_1", "f8", STEPS),
]:
    packed = fits.CompImageHDU(data.astype(type_of_pixels), header, compression_type=method, **level)
    fits.HDUList([fits.PrimaryHDU(), packed]).writeto(HERE / f"{name}.fits.fz", overwrite=True)

with fits.open(HERE / "psf_half_pixel.fits") as units:
    kernel = units["PSF"].data.astype("f8")
for name, method in [("kernel_rice_1", "RICE_1"), ("kernel_gzip_1", "GZIP_1")]:
    packed = fits.CompImageHDU(kernel, compression_type=method, name="PSF", quantize_level=-1e-7)
    fits.HDUList([fits.PrimaryHDU(), packed]).writeto(HERE / f"{name}.fits.fz", overwrite=True)

scaled = fits.PrimaryHDU(np.round(data / 1e-4).astype("i4"), header.copy())
scaled.header["BSCALE"] = 1e-4
scaled.header["BZERO"] = 0.0
with open(HERE / "scaled.fits", "wb") as file:
    scaled.writeto(file)
