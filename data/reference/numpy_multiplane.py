"""Multi-plane recursion with analytic Jacobians in numpy, written for comparison only; shares no code with haloray.

Needs: pip install numpy scipy

    x <- x + dchi s;  s <- s - f alpha(x/chi);  X <- X + dchi S;  S <- S - (f/chi) H X,  f = chi_s/(chi_s - chi)

NFW and TNFW use the forms of Bartelmann (1996) and Baltz, Marshall & Oguri (2009), the EPL those of
Tessore & Metcalf (2015) with scipy's 2F1; a ray of direction theta starts with x = 0, s = theta, X = 0, S = 1.
"""

import numpy as np
from scipy.special import hyp2f1

LN2 = np.log(2.0)


def nfw_functions(x):
    """A = arccosh(1/x)/sqrt(1-x^2) (arccos(1/x)/sqrt(x^2-1) beyond 1), (A-1)/(1-x^2) and (ln(x/2)+A)/x^2.

    Rewritten where the textbook forms subtract nearly equal numbers: a series in 1-x^2 near 1, logarithms of
    1 - x^2/(2(1+w)) with w = sqrt(1-x^2) inside.
    """
    x = np.asarray(x, dtype=float)
    z = (1 - x) * (1 + x)
    near = np.abs(z) < 0.1
    w = np.sqrt(np.where(near, 1.0, np.abs(z)))
    a = np.where(z > 0, np.log((1 + w) / x), np.arctan(w)) / w
    slope = (a - 1) / np.where(near, 1.0, z)
    close, series = np.where(near, z, 0.0), np.zeros_like(z)
    for n in reversed(range(18 if near.any() else 0)):
        series = series * close + 1 / (2 * n + 3)
    a, slope = np.where(near, 1 + z * series, a), np.where(near, series, slope)
    inside = (z > 0) & ~near
    small = np.where(inside, x, 0.5)
    v = np.sqrt((1 - small) * (1 + small))
    mean = (-np.log(small / 2) / (1 + v) + np.log1p(-small**2 / (2 * (1 + v))) / small**2) / v
    return a, slope, np.where(inside, mean, (np.log(x / 2) + a) / x**2)


def halo_radial(r, r_s, alpha_rs, tau=np.inf):
    """alpha/r and kappa of an NFW halo, truncated at tau r_s if tau is finite."""
    x = r / r_s
    k = alpha_rs / (r_s * (1 - LN2))
    f, slope, mean = nfw_functions(x)
    if not np.isfinite(tau):
        return k * mean, k * slope / 2
    t2 = tau**2
    s = np.sqrt(t2 + x**2)
    log = np.log(x / (s + tau))
    norm = t2 / (t2 + 1) ** 2
    g = norm * ((t2 + 1 + 2 * (x**2 - 1)) * f + tau * np.pi + (t2 - 1) * np.log(tau)
                + s * (-np.pi + (t2 - 1) / tau * log))
    kappa = norm / 2 * ((t2 + 1) * slope + 2 * f - np.pi / s + (t2 - 1) / (tau * s) * log)
    return k * g / x**2, k * kappa


def halo_kick(tx, ty, r_s, alpha_rs, tau=np.inf):
    """Deflection (2, n) and Hessian (3, n): xx, xy, yy at the offset (tx, ty) from its centre."""
    r = np.hypot(tx, ty)
    mean, kappa = halo_radial(r, r_s, alpha_rs, tau)
    directed = 2 * (kappa - mean) / r**2
    return (np.array([mean * tx, mean * ty]),
            np.array([mean + directed * tx**2, directed * tx * ty, mean + directed * ty**2]))


def epl_kick(x, y, theta_e, slope, e1, e2, center_x, center_y):
    """Deflection (2, n) and Hessian (3, n) of the elliptical power law."""
    e = np.hypot(e1, e2)
    q, t, turn = (1 - e) / (1 + e), slope - 1, np.exp(0.5j * np.arctan2(e2, e1))
    z = ((x - center_x) + 1j * (y - center_y)) / turn
    own = q * z.real + 1j * z.imag
    radius, b = np.abs(own), theta_e * np.sqrt(q)
    alpha = 2 / (1 + q) * (b / radius) ** t * own * hyp2f1(
        1, t / 2, 2 - t / 2, -(1 - q) / (1 + q) * own / own.conj())
    kappa = (2 - t) / 2 * (b / radius) ** t
    gamma = ((1 - t) * alpha - z * kappa) / z.conj() * turn**2
    alpha = alpha * turn
    return (np.array([alpha.real, alpha.imag]),
            np.array([kappa + gamma.real, gamma.imag, kappa - gamma.real]))


def trace(theta_x, theta_y, planes, chi_source):
    """beta (2, n) and A (4, n): xx, xy, yx, yy.

    `planes` are pairs (chi, kick) in order of distance, kick(theta_x, theta_y) -> deflection, Hessian.
    """
    s = np.array([theta_x, theta_y], dtype=float)
    position = np.zeros_like(s)
    jacobian, slope = np.zeros((2, 2, s.shape[1])), np.zeros((2, 2, s.shape[1]))
    slope[0, 0] = slope[1, 1] = 1.0
    at = 0.0
    for chi, kick in planes:
        position, jacobian = position + (chi - at) * s, jacobian + (chi - at) * slope
        at = chi
        f = chi_source / (chi_source - chi)
        alpha, (xx, xy, yy) = kick(position[0] / chi, position[1] / chi)
        s = s - f * alpha
        hessian = np.array([[xx, xy], [xy, yy]])
        slope = slope - f / chi * np.einsum("ijn,jkn->ikn", hessian, jacobian)
    position, jacobian = position + (chi_source - at) * s, jacobian + (chi_source - at) * slope
    return position / chi_source, jacobian.reshape(4, -1) / chi_source


def halo_plane(centre_x, centre_y, r_s, alpha_rs, tau=np.inf):
    """Kick of a halo and the sheet -kappa_h(0) in its plane."""
    _, kappa = halo_radial(np.hypot(centre_x, centre_y), r_s, alpha_rs, tau)

    def kick(x, y):
        alpha, hessian = halo_kick(x - centre_x, y - centre_y, r_s, alpha_rs, tau)
        return (alpha - kappa * np.array([x, y]),
                hessian - np.array([kappa, 0.0, kappa])[:, None])

    return kick, float(kappa)
