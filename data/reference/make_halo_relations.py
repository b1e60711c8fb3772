"""Reference sigma(M), growth, mass functions and concentrations from colossus.

Needs: pip install colossus numpy scipy
Run:   python3 make_halo_relations.py

colossus evaluates sigma(M), P(k) and D(z) from coarse tables (sigma to 3e-3 by default). Columns
ending in `_default` are what every user of colossus gets; columns ending in `_refined` come from the
same code with its table sizes and tolerances tightened, which shows how far the default tables are off.
`diemer19_*_direct` solves the published equation with scipy's brentq instead of colossus's table of
G(c, n), on the refined sigma.
"""

import importlib.metadata
import warnings

import numpy as np
import scipy.integrate
import scipy.optimize
from colossus.cosmology import cosmology
from colossus.halo import concentration, mass_so
from colossus.lss import mass_function, peaks

import reference_csv

warnings.simplefilter("ignore")
REDSHIFTS = np.arange(0.0, 2.01, 0.25)
MASSES_PER_H = np.logspace(8, 15, 57)
COMMAND = "python3 make_halo_relations.py"
VERSION = f"colossus {importlib.metadata.version('colossus')}"


def set_cosmology(refined):
    cosmo = cosmology.setCosmology("planck18", persistence="")
    if refined:
        cosmo.accuracy_sigma = 1e-7
        cosmo.R_Nbins_sigma = 150.0
        cosmo.k_Pk_Nbins = [10, 300, 1200, 400, 20]
        cosmo.z_Nbins = 1000
    return cosmo


def over_grid(function):
    """function(masses in Msun/h, z), flattened over all redshifts and masses."""
    return np.concatenate([np.broadcast_to(function(MASSES_PER_H, float(z)), MASSES_PER_H.shape)
                           for z in REDSHIFTS])


def dn_dlnm(model, definition):
    h = cosmology.getCurrent().h
    return over_grid(lambda m, z: h**3 * mass_function.massFunction(
        m, z, q_out="dndlnM", mdef=definition, model=model))


def sigma():
    cosmo = cosmology.getCurrent()
    return over_grid(lambda m, z: cosmo.sigma(peaks.lagrangianR(m), z))


def c(model, definition="200c", **kwargs):
    return over_grid(lambda m, z: concentration.concentration(
        m, definition, z, model=model, range_return=False, **kwargs))


def direct_diemer19(parameters):
    kappa, a0, a1, b0, b1, c_alpha = parameters
    cosmo = cosmology.getCurrent()

    def at(masses, z):
        n = peaks.powerSpectrumSlopeFromM(masses, z, slope_type="sigma", scale=kappa)
        nu = peaks.peakHeight(masses, z)
        alpha = -cosmo.growthFactor(z, derivative=1) * (1 + z) / cosmo.growthFactor(z)
        right = a0 * (1 + a1 * (n + 3)) / nu * (1 + nu**2 / (b0 * (1 + b1 * (n + 3))))
        mu = lambda x: np.log1p(x) - x / (1 + x)
        root = [scipy.optimize.brentq(lambda x: x / mu(x) ** ((5 + ni) / 6) - ri, 0.5, 1e4, xtol=1e-12)
                for ni, ri in zip(n, right)]
        return (1 - c_alpha * (1 - alpha)) * np.array(root)

    return over_grid(at)


cosmo = set_cosmology(refined=False)
assert (cosmo.H0, cosmo.Om0, cosmo.Ob0, cosmo.sigma8, cosmo.ns, cosmo.Tcmb0) == (
    67.66, 0.3111, 0.0490, 0.8102, 0.9665, 2.7255)
grid = {"z": over_grid(lambda m, z: z), "mass_msun": over_grid(lambda m, z: m / cosmo.h)}
relations = dict(grid)
relations["delta_m_rounded"] = over_grid(
    lambda m, z: float(round(mass_so.densityThreshold(z, "200c") / cosmo.rho_m(z))))
relations["sigma_default"] = sigma()
relations["tinker08_200c_default"] = dn_dlnm("tinker08", "200c")
concentrations = dict(grid)
concentrations["diemer19_median_default"] = c("diemer19", statistic="median")
concentrations["diemer19_mean_default"] = c("diemer19", statistic="mean")
concentrations["diemer15_default"] = c("diemer15")

cosmo = set_cosmology(refined=True)
relations["sigma_refined"] = sigma()
relations["dlnsigma_dlnm_refined"] = over_grid(
    lambda m, z: cosmo.sigma(peaks.lagrangianR(m), z, derivative=True) / 3)
relations["growth_refined"] = over_grid(lambda m, z: cosmo.growthFactor(z))
relations["tinker08_200c_refined"] = dn_dlnm("tinker08", "200c")
relations["sheth99_fof_refined"] = dn_dlnm("sheth99", "fof")
relations["press74_fof_refined"] = dn_dlnm("press74", "fof")
concentrations["diemer19_median_direct"] = direct_diemer19((0.41, 2.45, 1.82, 3.20, 2.30, 0.21))
concentrations["diemer19_mean_direct"] = direct_diemer19((0.42, 2.37, 1.74, 3.39, 1.82, 0.20))
concentrations["diemer15_refined"] = c("diemer15")
for definition in ("200c", "200m", "vir"):
    concentrations[f"duffy08_{definition}"] = c("duffy08", definition)

fine = np.logspace(8, 15, 20001)
dn = mass_function.massFunction(fine, 0.5, q_out="dndlnM", mdef="200c", model="tinker08") * cosmo.h**3
number = scipy.integrate.simpson(dn, x=np.log(fine))
NOTES = [
    "colossus works in Msun/h and Mpc/h; everything here was divided by its own h = 0.6766",
    "_default: colossus as installed; _refined: accuracy_sigma 1e-7, R_Nbins_sigma 150, "
    "k_Pk_Nbins [10, 300, 1200, 400, 20], z_Nbins 1000",
]
ORACLE = "colossus, cosmology planck18 (67.66, 0.3111, 0.0490, 0.8102, 0.9665, 2.7255 K)"
reference_csv.write(
    "halo_mass_functions", ORACLE, VERSION, COMMAND,
    "mass Msun; sigma dimensionless; mass functions dn/dlnM in comoving Mpc-3 (no h)",
    NOTES + [f"tinker08 200c refined, z = 0.5, integrated over 1e8-1e15 Msun/h: {number:.5f} Mpc-3; "
             f"with (0.674)^3 for h^3: {number * (0.674 / cosmo.h)**3:.5f}"],
    relations,
)
reference_csv.write(
    "halo_concentrations", ORACLE, VERSION, COMMAND, "mass Msun; concentrations dimensionless",
    NOTES + ["diemer19_*_direct: published equation solved with scipy brentq on the refined sigma",
             "duffy08_X: mass and concentration both in the definition X"],
    concentrations,
)
