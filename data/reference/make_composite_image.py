"""Reference image of a composite system of the mock catalogue, no noise, by lenstronomy.

Needs: pip install lenstronomy numpy
Run:   python3 make_composite_image.py

Stars (SERSIC_ELLIPSE_POTENTIAL) in an offset halo (NFW_ELLIPSE_POTENTIAL) behind the full line of sight (LOS); an elliptical
source with a perturber, light of the stars; one point a pixel, Gaussian PSF of 0.08 arcsec FWHM cut at 5 sigma.
"""

import importlib.metadata
import warnings

import numpy as np
from lenstronomy.Data.imaging_data import ImageData
from lenstronomy.Data.psf import PSF
from lenstronomy.ImSim.image_model import ImageModel
from lenstronomy.LensModel.lens_model import LensModel
from lenstronomy.LightModel.light_model import LightModel

import reference_csv

warnings.simplefilter("ignore")
PIXELS, SCALE = 61, 0.08
SHEARS = {"gamma1_od": 0.011, "gamma2_od": -0.017, "gamma1_os": -0.008, "gamma2_os": 0.021, "gamma1_ds": 0.013,
          "gamma2_ds": 0.005}
LOS = {f"{kind}_{part}": 0.0 for kind in ("kappa", "omega") for part in ("od", "os", "ds")} | SHEARS
STARS = {"k_eff": 1.1, "R_sersic": 0.31, "n_sersic": 4.3, "e1": 0.03, "e2": -0.02}
HALO = {"Rs": 5.2, "alpha_Rs": 1.6, "e1": -0.025, "e2": 0.03, "center_x": 0.041, "center_y": -0.055}
SOURCE = {"R_sersic": 0.35, "n_sersic": 3.7, "e1": 0.02, "e2": -0.04, "center_x": 0.153, "center_y": -0.092}
PERTURBER = {"R_sersic": 0.12, "n_sersic": 2.9, "center_x": 0.31, "center_y": -0.013, "e1": 0.05, "e2": -0.03}
MAGNITUDES = {"source": 23.7, "stars": 19.4}
PERTURBER_FLUX = 0.01

profile = LightModel(["SERSIC_ELLIPSE"]).func_list[0]


def with_flux(flux, parameters):
    """The parameters with the amplitude that gives that total flux."""
    own = {key: parameters[key] for key in ("R_sersic", "n_sersic")}
    return parameters | {"amp": flux / profile.total_flux(1.0, own["R_sersic"], own["n_sersic"])}


flux = {name: 10 ** (-0.4 * (magnitude - 25.96)) for name, magnitude in MAGNITUDES.items()}
centre = {"center_x": 0.0, "center_y": 0.0}
lens_light = with_flux(flux["stars"], {key: STARS[key] for key in ("R_sersic", "n_sersic", "e1", "e2")} | centre)
sources = [with_flux(flux["source"], SOURCE), with_flux(PERTURBER_FLUX * flux["source"], PERTURBER)]
corner = -0.5 * (PIXELS - 1) * SCALE
data = ImageData(image_data=np.zeros((PIXELS, PIXELS)), ra_at_xy_0=corner, dec_at_xy_0=corner,
                 transform_pix2angle=SCALE * np.eye(2), background_rms=1.0, exposure_time=1.0)
lens = LensModel(["LOS", "SERSIC_ELLIPSE_POTENTIAL", "NFW_ELLIPSE_POTENTIAL"])
model = ImageModel(data, PSF(psf_type="GAUSSIAN", fwhm=0.08, pixel_size=SCALE, truncation=5), lens_model_class=lens,
                   source_model_class=LightModel(["SERSIC_ELLIPSE"] * 2),
                   lens_light_model_class=LightModel(["SERSIC_ELLIPSE"]), kwargs_numerics={"supersampling_factor": 1})
image = model.image([LOS, STARS | centre, HALO], sources, [lens_light])
reference_csv.write(
    "composite_image", "lenstronomy ImageModel, LOS, GAUSSIAN psf, supersampling 1",
    f"lenstronomy {importlib.metadata.version('lenstronomy')}, numpy {np.__version__}",
    "python3 make_composite_image.py", "e-/s per pixel (zero point 25.96)",
    [f"{PIXELS} pixels of {SCALE} arcsec, row by row from the bottom left, x fastest", f"shears: {SHEARS}",
     f"stars: {STARS}, magnitude {MAGNITUDES['stars']}", f"halo: {HALO}",
     f"source: {SOURCE}, magnitude {MAGNITUDES['source']}", f"perturber of {PERTURBER_FLUX} of its flux: {PERTURBER}"],
    {"flux": [f"{value:.14e}" for value in image.ravel()]})
print(f"peak {image.max():.6g}")
