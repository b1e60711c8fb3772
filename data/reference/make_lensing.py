"""Reference deflections, Hessians and potentials of NFW, TNFW and EPL lenses, and Sersic brightness.

Needs: pip install lenstronomy mpmath numpy
Run:   python3 make_lensing.py

Columns `lenstronomy_*` are what every user of lenstronomy gets; columns `exact_*` are mpmath's with 30
digits. For the haloes mpmath integrates the three-dimensional density itself, so that no closed form of
the lens enters: with w = sqrt(1 - R^2/r^2) for r > R and w = 0 inside,

    kappa(R)  = 2 int_0^inf rho dz,                   r^2 = R^2 + z^2
    kappa'(R) = 2 int_0^inf rho'(r) R/r dz
    alpha(R)  = (4/R) int_0^inf rho r^2 (1 - w) dr
    psi(R)    = 4 int_0^inf rho r^2 K dr,             K = 1 - w + ln((1 + w)/2) [+ ln(R/r) for r < R].

For the EPL the deflection is mpmath's 2F1 and its derivatives are mpmath's differences at 60 digits.
"""

import importlib.metadata

import mpmath
import numpy as np
from lenstronomy.LensModel.lens_model import LensModel
from lenstronomy.LightModel.light_model import LightModel
from mpmath import mp, mpf

import reference_csv

mp.dps = 30
COMMAND = "python3 make_lensing.py"
VERSION = f"lenstronomy {importlib.metadata.version('lenstronomy')}, mpmath {mpmath.__version__}"
UNITS = "angles arcsec; potential arcsec2; Hessian, axis ratios and slopes dimensionless; third derivatives arcsec-1"
PARTS = ["psi", "alpha_x", "alpha_y", "f_xx", "f_xy", "f_yy"]
THIRD = ["f_xxx", "f_xxy", "f_xyy", "f_yyy"]


def text(value):
    return mpmath.nstr(mpf(value), 17, min_fixed=0, max_fixed=0)


def integral(function, scales):
    """int_0^inf function(r) dr in ln r, split at the scales where the integrand changes."""
    scales = sorted({mpf(s) for s in scales})
    edges = [s for low in scales for s in (low / 30, low, low * 30)]
    edges = [mp.log(e) for e in sorted(set(edges))]
    edges = [edges[0] - 60, edges[0] - 12] + edges + [edges[-1] + 12, edges[-1] + 60]
    return mp.quad(lambda s: function(mp.exp(s)) * mp.exp(s), edges)


def halo(radius, tau):
    """psi, alpha, kappa, kappa' at `radius` of a halo with r_s = 1 and k = alpha_Rs/(r_s (1 - ln 2)) = 1."""
    cut = (lambda r: 1) if tau is None else (lambda r: tau**2 / (tau**2 + r**2))
    rho = lambda r: cut(r) / (4 * r * (1 + r) ** 2)
    slope = lambda r: -1 / r - 2 / (1 + r) - (0 if tau is None else 2 * r / (tau**2 + r**2))
    w = lambda r: mp.sqrt((r - radius) * (r + radius)) / r if r > radius else mpf(0)
    less = lambda r: (radius / r) ** 2 / (1 + w(r)) if r > radius else mpf(1)
    scales = [radius, mpf(1)] + ([] if tau is None else [tau])
    # 1 - w + ln((1 + w)/2) with 1 - w = d is d + ln(1 - d/2).
    k = lambda r: less(r) + mp.log1p(-less(r) / 2) + (mp.log(radius / r) if r < radius else 0)
    r_of = lambda z: mp.sqrt(radius**2 + z**2)
    return (
        4 * integral(lambda r: rho(r) * r**2 * k(r), scales),
        4 / radius * integral(lambda r: rho(r) * r**2 * less(r), scales),
        2 * integral(lambda z: rho(r_of(z)), scales),
        2 * integral(lambda z: rho(r_of(z)) * slope(r_of(z)) * radius / r_of(z), scales),
    )


def check_against_closed_form():
    for x in (mpf("1e-4"), mpf("0.3"), mpf(40)):
        psi, alpha, kappa, _ = halo(x, None)
        with mp.workdps(60):
            root = mp.sqrt(1 - mp.mpc(x) ** 2)
            a = (mp.atanh(root) / root).real
            for got, want in ((alpha, (mp.log(x / 2) + a) / x), (kappa, (1 - a) / (x**2 - 1) / 2),
                              (psi, (mp.log(x / 2) ** 2 - (1 - x**2) * a**2) / 2)):
                assert abs(got / want - 1) < mpf("1e-22"), (x, got, want)


def exact_halo(x, y, r_s, alpha_rs, r_trunc):
    """All exact columns of an NFW (r_trunc None) or truncated NFW halo at the origin."""
    x, y, r_s, alpha_rs = (mpf(float(v)) for v in (x, y, r_s, alpha_rs))
    r = mp.sqrt(x**2 + y**2)
    psi, alpha, kappa, dkappa = halo(r / r_s, None if r_trunc is None else mpf(float(r_trunc)) / r_s)
    k = alpha_rs / (r_s * (1 - mp.log(2)))
    psi, alpha, kappa, dkappa = k * r_s**2 * psi, k * r_s * alpha, k * kappa, k / r_s * dkappa
    nx, ny = x / r, y / r
    first, second = alpha / r, 2 * kappa - alpha / r
    third = 2 * dkappa - (second - first) / r
    mixed = (second - first) / r
    return [
        psi, alpha * nx, alpha * ny,
        first + (second - first) * nx * nx, (second - first) * nx * ny, first + (second - first) * ny * ny,
        nx**3 * third + 3 * nx * ny**2 * mixed, nx**2 * ny * third + (ny**3 - 2 * nx**2 * ny) * mixed,
        nx * ny**2 * third + (nx**3 - 2 * nx * ny**2) * mixed, ny**3 * third + 3 * nx**2 * ny * mixed,
    ]


def exact_epl(x, y, slope, e1, e2):
    """All exact columns of an EPL of Einstein radius 1 at the origin."""
    x, y, slope, e1, e2 = (mpf(float(v)) for v in (x, y, slope, e1, e2))
    e = mp.hypot(e1, e2)
    q, phi, t = (1 - e) / (1 + e), mp.atan2(e2, e1) / 2, slope - 1
    turn, b = mp.expj(phi), mp.sqrt(q)

    def alpha(x, y):
        own = mp.mpc(x, y) / turn
        z = mp.mpc(q * own.real, own.imag)
        series = mp.hyp2f1(1, t / 2, 2 - t / 2, -(1 - q) / (1 + q) * z / z.conjugate())
        return 2 / (1 + q) * (b / abs(z)) ** t * z * series * turn

    at = alpha(x, y)
    with mp.workdps(60):
        d = lambda part, order: mp.diff(lambda x, y: getattr(alpha(x, y), part), (x, y), order)
        hessian = [d("real", (1, 0)), d("real", (0, 1)), d("imag", (0, 1))]
        third = [d("real", (2, 0)), d("real", (1, 1)), d("real", (0, 2)), d("imag", (0, 2))]
    return [(x * at.real + y * at.imag) / (2 - t), at.real, at.imag] + hessian + third


def lenstronomy(model, x, y, kwargs):
    lens = LensModel([model])
    x, y = np.array([float(x)]), np.array([float(y)])
    alpha = lens.alpha(x, y, [kwargs])
    f_xx, f_xy, _, f_yy = lens.hessian(x, y, [kwargs])
    values = [lens.potential(x, y, [kwargs]), *alpha, f_xx, f_xy, f_yy]
    return [float(value[0]) for value in values]


def write(name, oracle, notes, inputs, rows):
    names = inputs + [f"lenstronomy_{p}" for p in PARTS] + [f"exact_{p}" for p in PARTS + THIRD]
    columns = {column: [text(row[i]) for row in rows] for i, column in enumerate(names)}
    reference_csv.write(name, oracle, VERSION, COMMAND, UNITS, notes, columns)


def halo_rows(model, radii_over_r_s, halos):
    rows = []
    for r_s, alpha_rs, tau in halos:
        for i, ratio in enumerate(radii_over_r_s):
            turn = 0.3 + 0.7 * i
            x, y = float(ratio * r_s * np.cos(turn)), float(ratio * r_s * np.sin(turn))
            kwargs = {"Rs": r_s, "alpha_Rs": alpha_rs}
            inputs = [x, y, r_s, alpha_rs]
            if tau is not None:
                kwargs["r_trunc"] = tau * r_s
                inputs.append(tau * r_s)
            exact = exact_halo(x, y, r_s, alpha_rs, kwargs.get("r_trunc"))
            rows.append(inputs + lenstronomy(model, x, y, kwargs) + exact)
    return rows


check_against_closed_form()
SEAM = [1 - 1e-1, 1 - 1e-3, 1 - 1e-6, 1 - 1e-9, 1 + 1e-9, 1 + 1e-6, 1 + 1e-3, 1.1, 1.118, 1.12, 0.894, 0.895]
radii = np.concatenate([np.logspace(-4, 3, 57), SEAM])
ORACLE = "lenstronomy {}; mpmath integrals of the density, 30 digits"
write("nfw", ORACLE.format("NFW"), ["halo at the origin"], ["x", "y", "r_s", "alpha_rs"],
      halo_rows("NFW", radii, [(0.8, 0.01, None), (12.0, 0.6, None)]))
radii = np.concatenate([np.logspace(-4, 3, 29), SEAM[2:6]])
write("tnfw", ORACLE.format("TNFW"), ["halo at the origin"], ["x", "y", "r_s", "alpha_rs", "r_trunc"],
      halo_rows("TNFW", radii, [(0.8, 0.01, tau) for tau in (0.5, 1.0, 3.0, 10.0, 100.0)]))

rows = []
for slope in (1.2, 1.6, 2.0, 2.3, 2.6, 2.8):
    for e1, e2 in ((0.0, 0.0), (0.1, -0.05), (0.05, 0.3), (-0.5, 0.1)):
        for x, y in ((0.02, 0.013), (0.6, -0.7), (-1.3, 0.4), (0.0, 1.1), (-3.0, -2.0), (30.0, 0.0)):
            kwargs = {"theta_E": 1.0, "gamma": slope, "e1": e1, "e2": e2}
            rows.append([x, y, slope, e1, e2] + lenstronomy("EPL", x, y, kwargs)
                        + exact_epl(x, y, slope, e1, e2))
write("epl", "lenstronomy EPL; mpmath 2F1 and its differences, 30 digits",
      ["lens at the origin, theta_E = 1 arcsec"], ["x", "y", "slope", "e1", "e2"], rows)

sersic = {name: [] for name in ("x", "y", "flux", "radius", "index", "e1", "e2", "lenstronomy_amplitude",
                                "exact_amplitude", "lenstronomy_brightness", "exact_brightness")}
light = LightModel(["SERSIC_ELLIPSE"])
profile = light.func_list[0]
for flux in (15.275660582380723, 0.3):
    for radius, index in ((0.3, 6.0), (0.3, 1.0), (1.2, 4.0), (0.05, 0.6), (2.0, 9.5)):
        for e1, e2 in ((0.0, 0.0), (0.15, -0.1), (-0.3, 0.45)):
            amplitude = flux / profile.total_flux(1.0, radius, index)
            kwargs = {"amp": amplitude, "R_sersic": radius, "n_sersic": index, "e1": e1, "e2": e2,
                      "center_x": 0.1, "center_y": -0.2}
            n, b = mpf(index), mpf("1.9992") * mpf(index) - mpf("0.3271")
            exact_amplitude = mpf(flux) / (2 * mp.pi * n * mpf(radius) ** 2 * mp.exp(b) * b ** (-2 * n)
                                           * mp.gamma(2 * n))
            e = mp.hypot(mpf(e1), mpf(e2))
            q, phi = (1 - e) / (1 + e), mp.atan2(mpf(e2), mpf(e1)) / 2
            for x, y in ((0.1003, -0.2002), (0.12, -0.21), (0.4, 0.1), (-0.9, 1.3), (4.0, -3.0)):
                dx, dy = mpf(x) - mpf(0.1), mpf(y) + mpf(0.2)
                u, v = mp.cos(phi) * dx + mp.sin(phi) * dy, mp.cos(phi) * dy - mp.sin(phi) * dx
                r = mp.sqrt(q * u**2 + v**2 / q)
                exact = exact_amplitude * mp.exp(-b * ((r / mpf(radius)) ** (1 / n) - 1))
                theirs = light.surface_brightness(np.array([x]), np.array([y]), [kwargs])[0]
                row = (x, y, flux, radius, index, e1, e2, amplitude, exact_amplitude, theirs, exact)
                for column, value in zip(sersic.values(), row):
                    column.append(text(value))
reference_csv.write(
    "sersic", "lenstronomy SERSIC_ELLIPSE with amp = flux/total_flux(amp = 1); mpmath, 30 digits", VERSION,
    COMMAND, "angles arcsec; brightness and amplitude flux arcsec-2",
    ["centre (0.1, -0.2); lenstronomy floors R at 1e-4 arcsec, no row lies inside"], sersic)
