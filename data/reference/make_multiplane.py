"""Reference ray tracing: a cone of 300 haloes with on-axis sheets, alone, truncated, and with a main lens.

Needs: pip install lenstronomy astropy numpy scipy
Run:   python3 make_multiplane.py

beta and arrival times are lenstronomy's MultiPlane; lenstronomy takes its Jacobian by differences of 1e-8
arcsec, so A comes from the analytic recursion in numpy_multiplane.py, whose beta is asserted to agree with
lenstronomy's. Arrival times are differences to the first ray.
"""

import importlib.metadata
import warnings

import numpy as np
from astropy.cosmology import FlatLambdaCDM
from lenstronomy.LensModel.MultiPlane.multi_plane import MultiPlane

import numpy_multiplane
import reference_csv

warnings.simplefilter("ignore")
Z_SOURCE, NUMBER, TAU = 1.5, 300, 8.0
LENS = {"theta_E": 1.5, "gamma": 2.6, "e1": 0.08, "e2": -0.05, "center_x": 0.03, "center_y": -0.02}
Z_LENS = 0.5
cosmology = FlatLambdaCDM(67.4, 0.315, Tcmb0=0)
VERSION = f"lenstronomy {importlib.metadata.version('lenstronomy')}, numpy {np.__version__}"
COMMAND = "python3 make_multiplane.py"


def draw_cone():
    """Sizes, strengths and distances in units of r_s like those of a cone drawn from a mass function."""
    rng = np.random.default_rng(20261121)
    z = np.sort(rng.uniform(0.0, 1.0, NUMBER)) ** 0.5 * 1.42 + 0.05
    rng.shuffle(z)
    r_s = 10 ** rng.uniform(-1.2, 1.0, NUMBER)
    alpha_rs = 0.02 * r_s**1.3 * (1 - z / 1.6) * 10 ** rng.normal(0, 0.1, NUMBER)
    ratio = 10 ** rng.uniform(0.8, 2.6, NUMBER)
    ratio[:12] = 10 ** rng.uniform(-1.0, 0.9, 12)
    r_s[:12] = 10 ** rng.uniform(-1.2, -0.5, 12)
    alpha_rs[:12] = 0.02 * r_s[:12] ** 1.3
    phi = rng.uniform(0, 2 * np.pi, NUMBER)
    order = rng.permutation(NUMBER)
    columns = (z, ratio * r_s * np.cos(phi), ratio * r_s * np.sin(phi), r_s, alpha_rs)
    return [column[order] for column in columns]


def text(values):
    return [f"{float(value):.17g}" for value in values]


z, centre_x, centre_y, r_s, alpha_rs = draw_cone()
reference_csv.write(
    "multiplane_cone", "numpy default_rng(20261121), see draw_cone()", VERSION, COMMAND,
    "angles arcsec; alpha_rs reduced to z = 1.5", ["no particular order"],
    {"z": text(z), "theta_x_arcsec": text(centre_x), "theta_y_arcsec": text(centre_y),
     "r_s_arcsec": text(r_s), "alpha_rs_arcsec": text(alpha_rs)})

side = np.linspace(-2.25, 2.25, 8)
theta_y, theta_x = (grid.ravel() for grid in np.meshgrid(side + 0.011, side - 0.007, indexing="ij"))
chi_source = cosmology.comoving_distance(Z_SOURCE).value
chi = cosmology.comoving_distance(z).value


def trace(truncation, lens):
    """Columns beta_x, beta_y, a_xx .. a_yy, delay of one case."""
    models, redshifts, kwargs, planes = [], [], [], []
    for i in np.argsort(z):
        kick, kappa = numpy_multiplane.halo_plane(centre_x[i], centre_y[i], r_s[i], alpha_rs[i], truncation)
        planes.append((chi[i], kick))
        halo = {"Rs": r_s[i], "alpha_Rs": alpha_rs[i], "center_x": centre_x[i], "center_y": centre_y[i]}
        if np.isfinite(truncation):
            halo["r_trunc"] = truncation * r_s[i]
        models += ["TNFW" if np.isfinite(truncation) else "NFW", "CONVERGENCE"]
        redshifts += [z[i], z[i]]
        kwargs += [halo, {"kappa": -kappa}]
    if lens:
        models.append("EPL")
        redshifts.append(Z_LENS)
        kwargs.append(LENS)
        kick = lambda x, y: numpy_multiplane.epl_kick(
            x, y, LENS["theta_E"], LENS["gamma"], *(LENS[k] for k in ("e1", "e2", "center_x", "center_y")))
        planes.append((cosmology.comoving_distance(Z_LENS).value, kick))
        planes.sort(key=lambda plane: plane[0])
    oracle = MultiPlane(Z_SOURCE, models, redshifts, cosmo=cosmology)
    beta = np.array(oracle.ray_shooting(theta_x, theta_y, kwargs))
    own_beta, jacobian = numpy_multiplane.trace(theta_x, theta_y, planes, chi_source)
    f_xx, f_xy, f_yx, f_yy = oracle.hessian(theta_x, theta_y, kwargs, diff=1e-6)
    differences = np.array([1 - f_xx, -f_xy, -f_yx, 1 - f_yy])
    print(f"tau = {truncation}, lens {lens}: numpy against lenstronomy: "
          f"beta {np.abs(beta - own_beta).max():.1e} arcsec, A {np.abs(differences - jacobian).max():.1e}")
    assert np.abs(beta - own_beta).max() < 1e-11
    delay = oracle.arrival_time(theta_x, theta_y, kwargs)
    return [*beta, *jacobian, delay - delay[0]]


columns = {"theta_x_arcsec": text(theta_x), "theta_y_arcsec": text(theta_y)}
NAMES = ["beta_x", "beta_y", "a_xx", "a_xy", "a_yx", "a_yy", "delay_days"]
for case, truncation, lens in (("haloes", np.inf, False), ("lens", np.inf, True), ("truncated", TAU, False)):
    columns |= {f"{case}_{name}": text(values) for name, values in zip(NAMES, trace(truncation, lens))}
reference_csv.write(
    "multiplane_rays", "lenstronomy MultiPlane (beta, arrival time); numpy recursion (A)", VERSION, COMMAND,
    "theta and beta arcsec; delay days relative to the first ray",
    [f"flat LambdaCDM 67.4, 0.315, no radiation; z_source = {Z_SOURCE}; sheets -kappa_h(0) in every halo plane",
     f"lens: EPL at z = {Z_LENS}, {LENS}", f"truncated: TNFW with r_trunc = {TAU} Rs"], columns)
