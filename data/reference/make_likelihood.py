"""Reference likelihoods of one noisy image of Table 1 at random parameters, by lenstronomy and by brute force.

Needs: pip install lenstronomy==1.14.2 astropy numpy scipy
Run:   python3 make_likelihood.py

The image is 49 x 49 pixels of 0.08 arcsec, one point a pixel, Gaussian PSF of 0.08 arcsec FWHM cut at 5 sigma, made by
lenstronomy with the noise of numpy. At each parameter set `lenstronomy` is ImageLinearFit's own log-likelihood with
solved amplitudes; `marginalised` integrates exp(sum of -[(d-m)^2/v + ln 2 pi v]/2), v = max(m, 0)/t + sigma^2, times the
normal prior of both amplitudes (mean 0, standard deviation 1e6) by Gauss-Hermite quadrature, on lenstronomy's images.
"""

import datetime
import importlib.metadata
import json
import pathlib
import warnings

import numpy as np
from lenstronomy.Data.imaging_data import ImageData
from lenstronomy.Data.psf import PSF
from lenstronomy.ImSim.image_linear_solve import ImageLinearFit
from lenstronomy.LensModel.lens_model import LensModel
from lenstronomy.LightModel.light_model import LightModel
from scipy.optimize import minimize

warnings.simplefilter("ignore")
PIXELS, SCALE, EXPOSURE, BACKGROUND = 49, 0.08, 5400.0, 0.005919973387690837
CENTRE = {"center_x": 0.01375733, "center_y": -0.04843291}
# od, os, ds of the table; los = od + os - ds to first order is near enough for a truth
TRUTH = {"gamma1_od": -0.0027, "gamma2_od": -0.0060, "gamma1_los": -0.0308, "gamma2_los": -0.0520, "omega_los": 0.0001,
         "lens.theta_E": 1.2, "lens.gamma": 2.6, "lens.e1": -0.053, "lens.e2": 0.077, "source.R_sersic": 0.3,
         "source.n_sersic": 1.0, "source.e1": 0.104, "source.e2": -0.038, "source.center_x": -0.003,
         "source.center_y": 0.048, "lens_light.R_sersic": 0.5, "lens_light.n_sersic": 4.0}
# standard deviations of the widest draws; the others are 1/10 and 1/1000 of them
WIDTH = {"gamma1_od": 0.1, "gamma2_od": 0.1, "gamma1_los": 0.1, "gamma2_los": 0.1, "omega_los": 0.03,
         "lens.theta_E": 0.2, "lens.gamma": 0.15, "lens.e1": 0.1, "lens.e2": 0.1, "source.R_sersic": 0.08,
         "source.n_sersic": 0.2, "source.e1": 0.1, "source.e2": 0.1, "source.center_x": 0.03,
         "source.center_y": 0.03, "lens_light.R_sersic": 0.1, "lens_light.n_sersic": 0.5}
AMPLITUDE_SD = 1e6


def part(values, name):
    return {key.split(".")[1]: value for key, value in values.items() if key.startswith(name + ".")}


def keywords(values):
    sight = {key: values[key] for key in values if "." not in key} | {"kappa_od": 0.0, "kappa_los": 0.0, "omega_od": 0.0}
    lens = part(values, "lens")
    light = part(values, "lens_light") | CENTRE | {"e1": lens["e1"], "e2": lens["e2"]}
    return [sight, lens | CENTRE], [part(values, "source")], [light]


def amplitude(magnitude, radius, index):
    model = LightModel(["SERSIC_ELLIPSE"]).func_list[0]
    return 10 ** (-0.4 * (magnitude - 25.96)) / model.total_flux(1.0, radius, index)


def image_model(image):
    corner = -0.5 * (PIXELS - 1) * SCALE
    data = ImageData(image_data=image, ra_at_xy_0=corner, dec_at_xy_0=corner, transform_pix2angle=SCALE * np.eye(2),
                     background_rms=BACKGROUND, exposure_time=EXPOSURE)
    psf = PSF(psf_type="GAUSSIAN", fwhm=0.08, pixel_size=SCALE, truncation=5)
    return ImageLinearFit(data, psf, LensModel(["LOS_MINIMAL", "EPL"]), LightModel(["SERSIC_ELLIPSE"]),
                          LightModel(["SERSIC_ELLIPSE"]), kwargs_numerics={"supersampling_factor": 1})


def noisy_image(rng):
    lens, source, light = keywords(TRUTH)
    source[0]["amp"] = amplitude(24.0, 0.3, 1.0)
    light[0]["amp"] = amplitude(20.0, 0.5, 4.0)
    flux = image_model(np.zeros((PIXELS, PIXELS))).image(lens, source, light)
    sigma = np.sqrt(BACKGROUND**2 + np.maximum(flux, 0) / EXPOSURE)
    # as written to the file
    return np.array([float(f"{value:.9g}") for value in (flux + sigma * rng.standard_normal(flux.shape)).ravel()])


def marginalised(data, lights, start):
    """ln of the integral over the amplitudes, by 24 x 24 Gauss-Hermite nodes about the maximum."""
    def log_joint(a):
        model = a @ lights
        v = np.maximum(model, 0) / EXPOSURE + BACKGROUND**2
        prior = -0.5 * np.sum((a / AMPLITUDE_SD) ** 2 + np.log(2 * np.pi * AMPLITUDE_SD**2))
        return -0.5 * np.sum((data - model) ** 2 / v + np.log(2 * np.pi * v)) + prior

    model = start @ lights
    weight = 1 / (np.maximum(model, 0) / EXPOSURE + BACKGROUND**2)
    root = np.linalg.cholesky(np.linalg.inv((lights * weight) @ lights.T))
    best = minimize(lambda u: -log_joint(start + root @ u), np.zeros(2), method="Nelder-Mead",
                    options={"xatol": 1e-6, "fatol": 1e-9, "maxiter": 4000}).x
    nodes, weights = np.polynomial.hermite.hermgauss(24)
    top = log_joint(start + root @ best)
    total = sum(wi * wj * np.exp(log_joint(start + root @ (best + np.sqrt(2) * np.array([x, y]))) - top + x * x + y * y)
                for x, wi in zip(nodes, weights) for y, wj in zip(nodes, weights))
    return top + np.log(2 * total * abs(np.linalg.det(root)))


def main():
    rng = np.random.default_rng(20260)
    data = noisy_image(rng)
    model = image_model(data.reshape(PIXELS, PIXELS))
    cases = []
    while len(cases) < 24:
        spread = (0.001, 0.1, 1.0)[len(cases) % 3]
        values = {key: float(f"{TRUTH[key] + spread * WIDTH[key] * rng.standard_normal():.12g}") for key in TRUTH}
        lens, source, light = keywords(values)
        if not (values["source.n_sersic"] > 0.5 and values["lens.gamma"] < 2.95 and values["source.R_sersic"] > 0.02
                and values["lens_light.R_sersic"] > 0.05 and values["lens_light.n_sersic"] < 5):
            continue
        log_likelihood, _ = model.likelihood_data_given_model(lens, source, light)
        solved = model.image_linear_solve(lens, source, light)[3]
        lights = model.linear_response_matrix(lens, source, light, [])
        cases.append({"spread": spread, "values": values, "amplitudes": [float(a) for a in solved],
                      "lenstronomy": float(log_likelihood),
                      "marginalised": float(marginalised(data, lights, np.array(solved)))})
    versions = " ".join(f"{name} {importlib.metadata.version(name)}" for name in ("lenstronomy", "numpy", "scipy"))
    out = {"oracle": "lenstronomy ImageLinearFit.likelihood_data_given_model; Gauss-Hermite quadrature over amplitudes",
           "version": versions, "command": "python3 make_likelihood.py", "date": datetime.date.today().isoformat(),
           "units": "image in electrons per second per pixel, row by row from the bottom left; angles in arcsec",
           "pixels": PIXELS, "pixel_scale_arcsec": SCALE, "exposure_s": EXPOSURE, "background_rms_e_s": BACKGROUND,
           "psf_fwhm_arcsec": 0.08, "psf_truncation_sigma": 5.0, "cases": cases, "image_e_s": [float(v) for v in data]}
    path = pathlib.Path(__file__).resolve().parent / "likelihood.json"
    path.write_text(json.dumps(out, separators=(",", ":")).replace('{"spread"', '\n{"spread"') + "\n", encoding="utf-8")
    assert path.stat().st_size < 100_000, path.stat().st_size
    for case in cases:
        print(f"{case['spread']:6} {case['lenstronomy']:.6f} {case['marginalised']:.6f}")


if __name__ == "__main__":
    main()
