"""Reference distances and densities of flat LambdaCDM without radiation.

Needs: pip install astropy mpmath numpy scipy
Run:   python3 make_distances.py

astropy loses digits for tiny redshifts (it subtracts two nearly equal integrals), so a second column
holds the same integral by mpmath with 30 digits.
"""

import astropy
import mpmath
import numpy as np
from astropy.cosmology import FlatLambdaCDM

import reference_csv

H0_KM_S_MPC, OMEGA_M = 67.4, 0.315
cosmology = FlatLambdaCDM(H0_KM_S_MPC, OMEGA_M, Tcmb0=0)
mpmath.mp.dps = 30


def exact_comoving_mpc(z1, z2):
    omega_m = mpmath.mpf(OMEGA_M)
    hubble_distance = mpmath.mpf("299792.458") / mpmath.mpf(H0_KM_S_MPC)
    integrand = lambda z: 1 / mpmath.sqrt(omega_m * (1 + z) ** 3 + 1 - omega_m)
    edges = [mpmath.mpf(z1)] + [mpmath.mpf(z) for z in (1, 3, 8) if z1 < z < z2] + [mpmath.mpf(z2)]
    return float(hubble_distance * mpmath.quad(integrand, edges))


def text(values):
    return [f"{float(value):.17g}" for value in values]


VERSION = f"astropy {astropy.__version__}, mpmath {mpmath.__version__}"
ORACLE = f"astropy FlatLambdaCDM({H0_KM_S_MPC}, {OMEGA_M}, Tcmb0=0); mpmath quadrature, 30 digits"
COMMAND = "python3 make_distances.py"

z = np.concatenate([10.0 ** np.arange(-10, -2, 0.5), np.arange(0.01, 2, 0.02), np.arange(2, 20.01, 0.25)])
reference_csv.write(
    "distances", ORACLE, VERSION, COMMAND,
    "z and hubble_ratio dimensionless; distances Mpc; density physical Msun/Mpc3",
    ["comoving_exact_mpc is mpmath's, the other columns astropy's"],
    {
        "z": text(z),
        "hubble_ratio": text(cosmology.efunc(z)),
        "comoving_mpc": text(cosmology.comoving_distance(z).value),
        "comoving_exact_mpc": text(exact_comoving_mpc(0.0, value) for value in z),
        "angular_diameter_mpc": text(cosmology.angular_diameter_distance(z).value),
        "critical_density_msun_mpc3": text(cosmology.critical_density(z).to("Msun/Mpc3").value),
        "omega_m": text(cosmology.Om(z)),
    },
)

edges = [0.0, 1e-6, 0.01, 0.1, 0.1001, 0.3, 0.5, 0.5000001, 0.9, 1.4999999, 1.5, 2.0, 5.0, 10.0, 20.0]
pairs = np.array([(a, b) for a in edges for b in edges if a < b])
reference_csv.write(
    "distances_between", ORACLE, VERSION, COMMAND, "z1 and z2 dimensionless; distances Mpc",
    ["angular_diameter_mpc is astropy's, comoving_exact_mpc mpmath's"],
    {
        "z1": text(pairs[:, 0]),
        "z2": text(pairs[:, 1]),
        "comoving_exact_mpc": text(exact_comoving_mpc(a, b) for a, b in pairs),
        "angular_diameter_mpc": text(cosmology.angular_diameter_distance(pairs[:, 0], pairs[:, 1]).value),
    },
)
