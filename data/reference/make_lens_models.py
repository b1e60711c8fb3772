"""Reference lens models in lenstronomy's form: every line-of-sight model around every main lens, and lens planes.

Needs: pip install lenstronomy astropy numpy scipy
Run:   python3 make_lens_models.py

`f` is what lenstronomy's hessian() returns; `f_differences` are Richardson differences of lenstronomy's own
alpha(), so that the two differ where lenstronomy is not consistent with itself. The section
`lenstronomy_against_itself` holds such discrepancies; haloray enters none of these numbers.
"""

import csv
import datetime
import importlib.metadata
import json
import pathlib

import numpy as np
from astropy.cosmology import FlatLambdaCDM
from lenstronomy.LensModel.lens_model import LensModel
from lenstronomy.Util import constants

FOLDER = pathlib.Path(__file__).resolve().parent
H0, OM0 = 67.4, 0.315
COSMOLOGY = FlatLambdaCDM(H0, OM0, Tcmb0=0)
SEED, POINTS, MODELS, MULTI_PLANE_MODELS = 20240512, 4, 40, 6
SIGHTS = [None, "LOS", "LOS_MINIMAL", "LOS_FLEXION", "LOS_FLEXION_MINIMAL"]
MASSES = [["EPL"], ["SIE"], ["NFW"], ["TNFW"], ["SERSIC_ELLIPSE_POTENTIAL", "NFW_ELLIPSE_POTENTIAL"], ["POINT_MASS"]]
FIELDS = ["SHEAR", "CONVERGENCE", "FLEXION", None]
rng = np.random.default_rng(SEED)


def draw(low, high):
    return round(float(rng.uniform(low, high)), 5)


def numbers(names, size):
    return {name: draw(-size, size) for name in names}


def tidal(parts):
    return numbers([f"{q}_{p}" for p in parts for q in ("kappa", "gamma1", "gamma2")], 0.04)


def flexion(parts):
    return numbers([f"{q}_{p}" for p in parts for q in ("F1", "F2", "G1", "G2")], 0.004)


def line_of_sight(name):
    if name == "LOS":
        return tidal(["od", "os", "ds"]) | numbers(["omega_od", "omega_os", "omega_ds"], 0.02)
    if name == "LOS_MINIMAL":
        return tidal(["od", "los"]) | {"omega_od": 0.0} | numbers(["omega_los"], 0.02)
    if name == "LOS_FLEXION":
        return tidal(["od", "os", "ds"]) | flexion(["od", "os", "1ds", "2ds"]) | numbers(["omega_os"], 0.02)
    return tidal(["od", "los"]) | flexion(["od", "los", "1los"]) | numbers(["omega_los"], 0.02)


def profile(name, weight=1.0):
    if name in ("SHEAR", "CONVERGENCE", "FLEXION"):
        own = {"SHEAR": ["gamma1", "gamma2"], "CONVERGENCE": ["kappa"], "FLEXION": ["g1", "g2", "g3", "g4"]}[name]
        return numbers(own, weight * (0.01 if name == "FLEXION" else 0.08)) | numbers(["ra_0", "dec_0"], 0.1)
    kwargs = numbers(["center_x", "center_y"], 0.1)
    if name in ("EPL", "SIE", "SERSIC_ELLIPSE_POTENTIAL", "NFW_ELLIPSE_POTENTIAL"):
        kwargs |= numbers(["e1", "e2"], 0.12)
    if name in ("EPL", "SIE", "POINT_MASS"):
        kwargs["theta_E"] = round(draw(0.8, 1.6) * weight, 6)
    if name == "EPL":
        kwargs["gamma"] = draw(1.7, 2.6)
    if name == "SERSIC_ELLIPSE_POTENTIAL":
        kwargs |= {"k_eff": draw(0.1, 0.4), "R_sersic": draw(0.4, 1.2), "n_sersic": draw(1.5, 5.0)}
    if name in ("NFW", "TNFW", "NFW_ELLIPSE_POTENTIAL"):
        kwargs |= {"Rs": draw(4.0, 9.0), "alpha_Rs": round(draw(0.6, 1.5) * weight, 6)}
    if name == "TNFW":
        kwargs["r_trunc"] = draw(6.0, 40.0)
    return kwargs


def points():
    radius, angle = rng.uniform(0.5, 2.2, POINTS), rng.uniform(0, 2 * np.pi, POINTS)
    return np.round(radius * np.cos(angle), 6), np.round(radius * np.sin(angle), 6)


def differences(lens, x, y, kwargs, step=2e-3):
    """d(alpha_x)/dx, d(alpha_x)/dy, d(alpha_y)/dx, d(alpha_y)/dy of lenstronomy's alpha, error O(step^6)."""
    def central(axis, h):
        dx, dy = (h, 0) if axis == 0 else (0, h)
        ahead, behind = lens.alpha(x + dx, y + dy, kwargs), lens.alpha(x - dx, y - dy, kwargs)
        return np.subtract(ahead, behind) / (2 * h)

    def richardson(axis):
        d1, d2, d4 = (central(axis, step / n) for n in (1, 2, 4))
        return (16 * (4 * d4 - d2) / 3 - (4 * d2 - d1) / 3) / 15

    dx, dy = richardson(0), richardson(1)
    return np.array([dx[0], dy[0], dx[1], dy[1]])


def largest(values):
    return float(f"{np.max(np.abs(values)):.2e}")


def rows(*columns):
    return [[float(v) for v in row] for row in zip(*columns)]


def one_plane(index):
    sight = SIGHTS[index % 5]
    masses = MASSES[index // 5 % 6] if index < 30 else MASSES[rng.integers(6)]
    field = FIELDS[rng.integers(4)]
    names = ([sight] if sight else []) + masses + ([field] if field else [])
    kwargs = [line_of_sight(n) if n.startswith("LOS") else profile(n) for n in names]
    z_lens, z_source = draw(0.2, 0.8), draw(1.2, 2.5)
    lens = LensModel(names, z_lens=z_lens, z_source=z_source, cosmo=COSMOLOGY)
    x, y = points()
    f, own = np.array(lens.hessian(x, y, kwargs)), differences(lens, x, y, kwargs)
    group = f"{sight or 'no LOS'}, {' + '.join(masses)}"
    discrepancy = np.abs(f - own).max()
    hessians[group] = max(hessians.get(group, 0.0), discrepancy)
    return {
        "model": {"z_lens": z_lens, "z_source": z_source, "lens_model_list": names, "kwargs_lens": kwargs,
                  "cosmology": {"H0": H0, "Om0": OM0}},
        "theta": rows(x, y), "beta": rows(*lens.ray_shooting(x, y, kwargs)), "f": rows(*f),
        "f_differences": [[float(f"{v:.13g}") for v in row] for row in zip(*own)],
        "fermat_arcsec2": [float(v) for v in lens.fermat_potential(x, y, kwargs)],
        "arrival_days": [float(v) for v in lens.arrival_time(x, y, kwargs)],
    }


def many_planes(index):
    names = ["EPL", "NFW", "SHEAR", "TNFW", "SIE", "CONVERGENCE", "POINT_MASS"][: 3 + index % 5]
    kwargs = [profile(n, 1.0 if i == 0 else 0.1) for i, n in enumerate(names)]
    redshifts = [0.5] + [draw(0.1, 1.4) for _ in names[1:]]
    if index % 2:
        redshifts[2] = redshifts[1]
    lens = LensModel(names, z_source=1.5, cosmo=COSMOLOGY, multi_plane=True, lens_redshift_list=redshifts)
    x, y = points()
    return {
        "model": {"z_source": 1.5, "lens_model_list": names, "kwargs_lens": kwargs,
                  "lens_redshift_list": redshifts, "cosmology": {"H0": H0, "Om0": OM0}},
        "theta": rows(x, y), "beta": rows(*lens.ray_shooting(x, y, kwargs)),
        "f": rows(*lens.hessian(x, y, kwargs)),
        "f_differences": [[float(f"{v:.13g}") for v in row] for row in zip(*differences(lens, x, y, kwargs))],
        "arrival_days": [float(v) for v in lens.arrival_time(x, y, kwargs)],
    }


def minimal_with_rotation():
    """beta and the gradient of the Fermat potential at fixed beta for omega_od = 0.02, all else 0 but a shear."""
    los = {k: 0.0 for k in line_of_sight("LOS_MINIMAL")} | {"omega_od": 0.02, "gamma1_los": 0.03}
    epl = {"theta_E": 1.5, "gamma": 2.1, "e1": 0.1, "e2": 0.05, "center_x": 0.0, "center_y": 0.0}
    lens, main = LensModel(["LOS_MINIMAL", "EPL"], z_lens=0.5, z_source=1.5, cosmo=COSMOLOGY), LensModel(["EPL"])
    x, y, h = 1.2, 0.7, 1e-4
    beta = lens.ray_shooting(x, y, [los, epl])
    a_od, a_los = np.array([[1, 0.02], [-0.02, 1]]), np.array([[0.97, 0], [0, 1.03]])
    theta = np.array([x, y])
    expected = a_los @ theta - a_od.T @ np.array(main.alpha(*(a_od @ theta), [epl]))
    phi = lambda x, y: lens.fermat_potential(x, y, [los, epl], *beta)
    gradient = [(phi(x + h, y) - phi(x - h, y)) / (2 * h), (phi(x, y + h) - phi(x, y - h)) / (2 * h)]
    return {"beta_arcsec": largest(np.subtract(beta, expected)), "fermat_gradient_arcsec": largest(gradient)}


def sie_against_epl():
    sie = {"theta_E": 1.3, "e1": 0.1, "e2": -0.05, "center_x": 0.0, "center_y": 0.0}
    x, y = points()
    one, other = LensModel(["SIE"]), LensModel(["EPL"])
    return {
        f"{quantity}": largest(np.subtract(getattr(one, quantity)(x, y, [sie]),
                                           getattr(other, quantity)(x, y, [sie | {"gamma": 2.0}])))
        for quantity in ("potential", "alpha", "hessian")
    }


def table(name):
    """Rows of a reference table beside this script, with the radius over r_s."""
    with open(FOLDER / f"{name}.csv", encoding="utf-8") as lines:
        found = [{k: float(v) for k, v in row.items()} for row in csv.DictReader(l for l in lines if l[0] != "#")]
    for row in found:
        row["ratio"] = np.hypot(row["x"], row["y"]) / row["r_s"]
    return found


def halo_by_radius(name):
    """Largest differences from the exact columns of `name`.csv in rings of radius over r_s."""
    rings = {f"{d:g} from r_s": lambda x, d=d: abs(abs(x - 1) / d - 1) < 1e-3 for d in (1e-9, 1e-6, 1e-3)}
    rings |= {f"{low:g} to {high:g} r_s": lambda x, low=low, high=high: low <= x <= high
              for low, high in ((0.9e-4, 2e-4), (9e-4, 2e-3), (9e-3, 2e-2), (0.1, 0.99), (1.01, 10), (30, 2000))}
    found = {ring: [row for row in table(name) if inside(row["ratio"])] for ring, inside in rings.items()}
    return {ring: halo_against_exact(near) for ring, near in found.items() if near}


def halo_against_exact(near):
    """Largest difference, over the largest component of each quantity."""
    parts = {"potential": ["psi"], "deflection": ["alpha_x", "alpha_y"], "hessian": ["f_xx", "f_xy", "f_yy"]}
    result = {}
    for quantity, columns in parts.items():
        ratios = [
            max(abs(row[f"lenstronomy_{c}"] - row[f"exact_{c}"]) for c in columns)
            / max(abs(row[f"exact_{c}"]) for c in columns)
            for row in near
        ]
        result[quantity] = largest(ratios)
    return result


def flexion_hessian_by_part():
    """LOS_FLEXION about an EPL: its hessian against differences of its alpha, one kind of parameter at a time."""
    names = ["LOS_FLEXION", "EPL"]
    epl = {"theta_E": 1.5, "gamma": 2.1, "e1": 0.1, "e2": 0.05, "center_x": 0.0, "center_y": 0.0}
    zero = {k: 0.0 for k in line_of_sight("LOS_FLEXION")}
    x, y = np.array([1.2, -0.4, 0.3]), np.array([0.7, 1.1, -1.6])
    result = {}
    for label, kinds in {"kappa 0.02": {"kappa": 0.02}, "gamma 0.02": {"gamma": 0.02}, "omega_os 0.02": {"omega": 0.02},
                         "F and G 0.001": {"F": 0.001, "G": 0.001},
                         "kappa, gamma 0.02, F, G 0.001": {"kappa": 0.02, "gamma": 0.02, "F": 0.001, "G": 0.001}}.items():
        los = zero | {k: v for k in zero for start, v in kinds.items() if k.startswith(start)}
        lens = LensModel(names, z_lens=0.5, z_source=1.5, cosmo=COSMOLOGY)
        result[label] = largest(np.array(lens.hessian(x, y, [los, epl])) - differences(lens, x, y, [los, epl]))
    return result


def hessian_of_one_profile():
    """The hessian of each profile alone against differences of its alpha, 48 points of 0.5 to 2 arcsec."""
    angle = np.tile(np.arange(12) * np.pi / 6 + 0.1, 4)
    radius = np.repeat([0.5, 0.9, 1.4, 2.0], 12)
    x, y = radius * np.cos(angle), radius * np.sin(angle)
    shape = {"e1": 0.1, "e2": -0.05, "center_x": 0.0, "center_y": 0.0}
    own = {
        "EPL": {"theta_E": 1.3, "gamma": 2.2}, "SIE": {"theta_E": 1.3}, "NFW_ELLIPSE_POTENTIAL": {"Rs": 6.0, "alpha_Rs": 1.0},
        "SERSIC_ELLIPSE_POTENTIAL": {"k_eff": 0.3, "R_sersic": 0.8, "n_sersic": 4.0},
    }
    result = {}
    for name, kwargs in own.items():
        lens, kwargs = LensModel([name]), [kwargs | shape]
        result[name] = largest(np.array(lens.hessian(x, y, kwargs)) - differences(lens, x, y, kwargs))
    return result


def constants_against_iau():
    au, arcsec = 149_597_870_700.0, np.pi / 648_000
    mpc = au / arcsec * 1e6
    ours = mpc / 299_792_458.0 / 86_400.0 * arcsec**2
    theirs = constants.Mpc / constants.c / constants.day_s * constants.arcsec**2
    return {"delay_relative": float(f"{theirs / ours - 1:.3e}"),
            "g_msun_relative": float(f"{constants.G * constants.M_sun / 1.3271244e20 - 1:.3e}")}


hessians = {}
models = [one_plane(i) for i in range(MODELS)]
planes = [many_planes(i) for i in range(MULTI_PLANE_MODELS)]
whole = {
    "oracle": "lenstronomy LensModel: ray_shooting, hessian, fermat_potential, arrival_time; differences of alpha",
    "version": ", ".join(f"{p} {importlib.metadata.version(p)}" for p in ("lenstronomy", "astropy", "numpy")),
    "command": "python3 make_lens_models.py",
    "date": datetime.date.today().isoformat(),
    "units": "theta, beta arcsec as [x, y]; f = d(alpha_i)/d(theta_j) as [xx, xy, yx, yy], dimensionless; "
             "fermat arcsec2; arrival days; H0 km/s/Mpc",
    "lenstronomy_against_itself": {
        "hessian_against_differences_of_alpha": {k: float(f"{v:.1e}") for k, v in sorted(hessians.items())},
        "multi_plane_hessian": largest([np.subtract(m["f"], m["f_differences"]) for m in planes]),
        "los_minimal_omega_od_0.02": minimal_with_rotation(),
        "sie_against_epl": sie_against_epl(),
        "constants_against_iau_2015": constants_against_iau(),
        "nfw": halo_by_radius("nfw"),
        "tnfw": halo_by_radius("tnfw"),
        "los_flexion_hessian": flexion_hessian_by_part(),
        "hessian_of_one_profile": hessian_of_one_profile(),
    },
    "models": models,
    "multi_plane_models": planes,
}
head = json.dumps({k: v for k, v in whole.items() if not k.endswith("models")}, indent=1)[:-2]
listed = lambda name: f' "{name}": [\n' + ",\n".join(json.dumps(m) for m in whole[name]) + "\n ]"
path = FOLDER / "lens_models.json"
path.write_text(f"{head},\n{listed('models')},\n{listed('multi_plane_models')}\n}}\n", encoding="utf-8")
assert json.loads(path.read_text(encoding="utf-8")) == whole
assert path.stat().st_size < 120_000, path.stat().st_size
print(f"{path.name}: {len(models)} + {len(planes)} models, {path.stat().st_size} bytes")
