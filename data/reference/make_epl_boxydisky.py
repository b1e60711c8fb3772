"""Reference deflections, Hessians and potentials of lenstronomy's EPL_BOXYDISKY, and what is off in them.

Needs: pip install lenstronomy mpmath numpy
Run:   python3 make_epl_boxydisky.py

Columns `lenstronomy_*` are what every user of lenstronomy gets; columns `exact_*` are mpmath's with 30 digits: the
deflection of the EPL by 2F1 and that of the multipole from its potential

    psi_4 = -(a/15) r cos 4(phi - phi_m),  a = a4_a theta_E/sqrt(q),

(Xu et al. 2015, eq. B12; Van de Vyvere et al. 2022) by mpmath's differences at 60 digits, as all higher derivatives.
"""

import importlib.metadata

import mpmath
import numpy as np
from lenstronomy.LensModel.lens_model import LensModel
from mpmath import mp, mpf

import reference_csv

mp.dps = 30
COMMAND = "python3 make_epl_boxydisky.py"
VERSION = f"lenstronomy {importlib.metadata.version('lenstronomy')}, mpmath {mpmath.__version__}"
UNITS = "angles arcsec; potential arcsec2; Hessian, slopes, ellipticities and a4_a dimensionless; third derivatives arcsec-1"
INPUTS = ["x", "y", "theta_e", "slope", "e1", "e2", "a4_a"]
PARTS = ["psi", "alpha_x", "alpha_y", "f_xx", "f_xy", "f_yy"]
THIRD = ["f_xxx", "f_xxy", "f_xyy", "f_yyy"]
lens = LensModel(["EPL_BOXYDISKY"])


def lenstronomy(x, y, theta_e, slope, e1, e2, a4_a):
    kwargs = [{"theta_E": theta_e, "gamma": slope, "e1": e1, "e2": e2, "a4_a": a4_a}]
    x, y = np.array([x]), np.array([y])
    f_xx, f_xy, _, f_yy = lens.hessian(x, y, kwargs)
    return [float(v[0]) for v in (lens.potential(x, y, kwargs), *lens.alpha(x, y, kwargs), f_xx, f_xy, f_yy)]


def exact(*row):
    x, y, theta_e, slope, e1, e2, a4_a = (mpf(float(v)) for v in row)
    e = mp.hypot(e1, e2)
    q, phi_m, t = (1 - e) / (1 + e), mp.atan2(e2, e1) / 2, slope - 1
    turn, b, a = mp.expj(phi_m), theta_e * mp.sqrt(q), a4_a * theta_e / mp.sqrt(q)

    def epl(x, y):
        own = mp.mpc(x, y) / turn
        z = mp.mpc(q * own.real, own.imag)
        series = mp.hyp2f1(1, t / 2, 2 - t / 2, -(1 - q) / (1 + q) * z / z.conjugate())
        return 2 * b / (1 + q) * (b / abs(z)) ** (t - 1) * z / abs(z) * series * turn

    def multipole(x, y):
        return -a / 15 * mp.hypot(x, y) * mp.cos(4 * (mp.atan2(y, x) - phi_m))

    def derivative(nx, ny):
        """d^(nx+ny) psi of the whole."""
        of_multipole = mp.diff(multipole, (x, y), (nx, ny))
        part, order = ("real", (nx - 1, ny)) if nx else ("imag", (nx, ny - 1))
        of_epl = getattr(epl(x, y), part) if sum(order) == 0 else mp.diff(
            lambda x, y: getattr(epl(x, y), part), (x, y), order)
        return of_epl + of_multipole

    with mp.workdps(60):
        alpha = epl(x, y)
        psi = (x * alpha.real + y * alpha.imag) / (2 - t) + multipole(x, y)
        orders = [(1, 0), (0, 1), (2, 0), (1, 1), (0, 2), (3, 0), (2, 1), (1, 2), (0, 3)]
        return [psi] + [derivative(*order) for order in orders]


rows = []
for slope in (1.6, 2.0, 2.4):
    for e1, e2 in ((0.0, 0.0), (0.1, -0.05), (0.05, 0.3), (-0.2, 0.1)):
        for theta_e, a4_a in ((1.0, 0.03), (1.4, -0.08)):
            for x, y in ((0.02, 0.013), (0.6, -0.7), (-1.3, 0.4), (-3.0, -2.0)):
                row = (x, y, theta_e, slope, e1, e2, a4_a)
                rows.append(list(row) + lenstronomy(*row) + exact(*row))

for name, parts in (("psi", [0]), ("alpha", [1, 2]), ("Hessian", [3, 4, 5])):
    at = lambda row, offset: np.array([float(row[len(INPUTS) + offset + i]) for i in parts])
    worst = max(np.abs(at(row, 0) - at(row, len(PARTS))).max() for row in rows)
    print(f"lenstronomy's {name}: {worst:.1e} from 30 digits")
names = INPUTS + [f"lenstronomy_{p}" for p in PARTS] + [f"exact_{p}" for p in PARTS + THIRD]
text = lambda value: mpmath.nstr(mpf(value), 17, min_fixed=0, max_fixed=0)
columns = {column: [text(row[i]) for row in rows] for i, column in enumerate(names)}
reference_csv.write("epl_boxydisky", "lenstronomy EPL_BOXYDISKY; mpmath 2F1, multipole and their differences, 30 digits",
                    VERSION, COMMAND, UNITS, ["lens at the origin; within 1e-6 arcsec of it, where no row lies, lenstronomy's Hessian of the multipole is that at 1e-6"], columns)
