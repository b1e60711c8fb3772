"""Reference image: an elliptical Sersic source behind an EPL lens and two haloes, no noise, by lenstronomy.

Needs: pip install lenstronomy astropy numpy
Run:   python3 make_image.py

One point a pixel (supersampling 1), Gaussian PSF of 0.08 arcsec FWHM cut at 5 sigma, 64 x 64 pixels of 0.08 arcsec.
"""

import importlib.metadata
import warnings

import numpy as np
from astropy.cosmology import FlatLambdaCDM
from lenstronomy.Data.imaging_data import ImageData
from lenstronomy.Data.psf import PSF
from lenstronomy.ImSim.image_model import ImageModel
from lenstronomy.LensModel.lens_model import LensModel
from lenstronomy.LightModel.light_model import LightModel

import reference_csv

warnings.simplefilter("ignore")
PIXELS, SCALE = 64, 0.08
FLUX = 10 ** (-0.4 * (23.0 - 25.96))
LENS = {"theta_E": 1.5, "gamma": 2.6, "e1": 0.08, "e2": -0.05, "center_x": 0.03, "center_y": -0.02}
HALOES = [(0.3, {"Rs": 0.4, "alpha_Rs": 0.01, "center_x": 1.1, "center_y": -0.9}),
          (0.8, {"Rs": 0.3, "alpha_Rs": 0.006, "center_x": -0.7, "center_y": 1.2})]
SOURCE = {"R_sersic": 0.3, "n_sersic": 6.0, "e1": 0.1, "e2": -0.05, "center_x": 0.043, "center_y": 0.071}

light = LightModel(["SERSIC_ELLIPSE"])
amplitude = FLUX / light.func_list[0].total_flux(1.0, SOURCE["R_sersic"], SOURCE["n_sersic"])
lens = LensModel(["NFW", "EPL", "NFW"], z_source=1.5, lens_redshift_list=[HALOES[0][0], 0.5, HALOES[1][0]],
                 multi_plane=True, cosmo=FlatLambdaCDM(67.4, 0.315, Tcmb0=0))
corner = -0.5 * (PIXELS - 1) * SCALE
data = ImageData(image_data=np.zeros((PIXELS, PIXELS)), ra_at_xy_0=corner, dec_at_xy_0=corner,
                 transform_pix2angle=SCALE * np.eye(2), background_rms=1.0, exposure_time=1.0)
psf = PSF(psf_type="GAUSSIAN", fwhm=0.08, pixel_size=SCALE, truncation=5)
model = ImageModel(data, psf, lens_model_class=lens, source_model_class=light,
                   kwargs_numerics={"supersampling_factor": 1})
image = model.image([HALOES[0][1], LENS, HALOES[1][1]], [SOURCE | {"amp": amplitude}])
reference_csv.write(
    "image", "lenstronomy ImageModel, GAUSSIAN psf, supersampling 1",
    f"lenstronomy {importlib.metadata.version('lenstronomy')}, numpy {np.__version__}", "python3 make_image.py",
    "flux per pixel in units of the source's flux unit (zero point 25.96)",
    [f"{PIXELS} pixels of {SCALE} arcsec, row by row from the bottom left, x fastest",
     f"EPL at z = 0.5, source at 1.5, flat LambdaCDM 67.4, 0.315: {LENS}", f"NFW (z, parameters): {HALOES}",
     f"SERSIC_ELLIPSE of magnitude 23.0: {SOURCE}"],
    {"flux": [f"{value:.13e}" for value in image.ravel()]})
print(f"peak {image.max():.6g}")
