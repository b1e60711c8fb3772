"""``haloray.LensModel`` beside lenstronomy's, profile by profile."""

import numpy as np
import pytest
from conftest import SMALL

import haloray as hr

lens_model = pytest.importorskip("lenstronomy.LensModel.lens_model")
astropy_cosmology = pytest.importorskip("astropy.cosmology")

ELLIPSE = {"e1": 0.12, "e2": -0.07, "center_x": 0.02, "center_y": -0.03}
CENTRE = {"center_x": 0.02, "center_y": -0.03}
#: Arguments of every profile, how well lenstronomy's α follows them, and its Hessian where that is analytic
#: (docs/LENSTRONOMY.md says which, and why).
PROFILES = {
    "EPL": ({"theta_E": 1.4, "gamma": 2.2, **ELLIPSE}, 1e-12, 1e-11),
    "SIE": ({"theta_E": 1.4, **ELLIPSE}, 5e-10, None),
    "SIS": ({"theta_E": 1.4, **CENTRE}, 1e-12, 1e-11),
    "EPL_BOXYDISKY": ({"theta_E": 1.4, "gamma": 2.2, "a4_a": 0.03, **ELLIPSE}, 1e-11, 1e-10),
    "NFW": ({"Rs": 3.1, "alpha_Rs": 0.9, **CENTRE}, 1e-11, 1e-10),
    "NFW_ELLIPSE_POTENTIAL": ({"Rs": 3.1, "alpha_Rs": 0.9, **ELLIPSE}, 1e-11, None),
    "TNFW": ({"Rs": 3.1, "alpha_Rs": 0.9, "r_trunc": 9.0, **CENTRE}, 1e-10, 1e-9),
    "SERSIC": ({"k_eff": 0.3, "R_sersic": 0.9, "n_sersic": 3.5, **CENTRE}, 1e-11, None),
    "SERSIC_ELLIPSE_POTENTIAL": ({"k_eff": 0.3, "R_sersic": 0.9, "n_sersic": 3.5, **ELLIPSE}, 1e-11, None),
    "POINT_MASS": ({"theta_E": 0.9, **CENTRE}, 1e-12, 1e-11),
    "SHEAR": ({"gamma1": 0.05, "gamma2": -0.02}, 1e-14, 1e-14),
    "SHEAR_GAMMA_PSI": ({"gamma_ext": 0.05, "psi_ext": 0.7}, 1e-14, 1e-14),
    "CONVERGENCE": ({"kappa": 0.05}, 1e-14, 1e-14),
    "FLEXION": ({"g1": 0.01, "g2": -0.02, "g3": 0.005, "g4": 0.003}, 1e-14, 1e-14),
}
TIDAL = {"kappa": 0.02, "gamma1": 0.03, "gamma2": -0.01}


def tidal(*places):
    return {f"{name}_{place}": value * (1 + i) for i, place in enumerate(places) for name, value in TIDAL.items()}


def flexion(*places):
    return {f"{name}_{place}": 1e-3 * (1 + i) for i, place in enumerate(places) for name in ("F1", "F2", "G1", "G2")}


LINES_OF_SIGHT = {
    "LOS": tidal("od", "os", "ds") | {"omega_od": 0.01, "omega_os": 0.02, "omega_ds": -0.01},
    "LOS_MINIMAL": tidal("od", "los") | {"omega_od": 0.0, "omega_los": 0.02},
    "LOS_FLEXION": tidal("od", "os", "ds") | flexion("od", "os", "1ds", "2ds") | {"omega_os": 0.0},
    "LOS_FLEXION_MINIMAL": tidal("od", "los") | flexion("od", "los", "1los") | {"omega_los": 0.0},
}

RANDOM = np.random.default_rng(11)
RADIUS, ANGLE = RANDOM.uniform(0.4, 3.0, 60), RANDOM.uniform(0.0, 6.28, 60)
X, Y = RADIUS * np.cos(ANGLE), RADIUS * np.sin(ANGLE)
#: Step of differences of lenstronomy's α.
STEP = 2e-4


def differences(model, kwargs):
    """f_xx, f_xy, f_yx, f_yy from differences of α."""
    along_x = [(a - b) / (2 * STEP) for a, b in zip(model.alpha(X + STEP, Y, kwargs), model.alpha(X - STEP, Y, kwargs))]
    along_y = [(a - b) / (2 * STEP) for a, b in zip(model.alpha(X, Y + STEP, kwargs), model.alpha(X, Y - STEP, kwargs))]
    return along_x[0], along_y[0], along_x[1], along_y[1]


def test_every_name_is_compared():
    assert {*PROFILES, *LINES_OF_SIGHT} == set(hr.LENS_MODELS)


@pytest.mark.parametrize("name", PROFILES)
def test_a_profile(name):
    kwargs, tolerance, of_hessian = PROFILES[name]
    ours, theirs = hr.LensModel([name]), lens_model.LensModel([name])
    close = dict(rtol=0.0, atol=tolerance)
    np.testing.assert_allclose(ours.alpha(X, Y, [kwargs]), theirs.alpha(X, Y, [kwargs]), **close)
    np.testing.assert_allclose(ours.ray_shooting(X, Y, [kwargs]), theirs.ray_shooting(X, Y, [kwargs]), **close)
    np.testing.assert_allclose(ours.hessian(X, Y, [kwargs]), differences(theirs, [kwargs]), rtol=0, atol=1e-6)
    if of_hessian is not None:
        close = dict(rtol=of_hessian, atol=of_hessian)
        np.testing.assert_allclose(ours.hessian(X, Y, [kwargs]), theirs.hessian(X, Y, [kwargs]), **close)
        np.testing.assert_allclose(ours.kappa(X, Y, [kwargs]), theirs.kappa(X, Y, [kwargs]), **close)
        np.testing.assert_allclose(ours.gamma(X, Y, [kwargs]), theirs.gamma(X, Y, [kwargs]), **close)
    # lenstronomy leaves constants in some potentials: differences are what counts.
    potentials = [model.potential(X, Y, [kwargs]) for model in (ours, theirs)]
    np.testing.assert_allclose(*(own - own[0] for own in potentials), rtol=1e-9, atol=1e-9)
    fermat = [model.fermat_potential(X, Y, [kwargs]) for model in (ours, theirs)]
    np.testing.assert_allclose(*(own - own[0] for own in fermat), rtol=1e-9, atol=1e-8)


@pytest.mark.parametrize("name", PROFILES)
def test_flexion_is_the_derivative_of_the_hessian(name):
    kwargs = [PROFILES[name][0]]
    lens, step = hr.LensModel([name]), 1e-4
    x, y = np.array([1.1, -0.7, 0.4]), np.array([0.3, 0.9, -1.3])
    f_xxx, f_xxy, f_xyy, f_yyy = lens.flexion(x, y, kwargs)
    along_x = [
        (a - b) / (2 * step) for a, b in zip(lens.hessian(x + step, y, kwargs), lens.hessian(x - step, y, kwargs))
    ]
    along_y = [
        (a - b) / (2 * step) for a, b in zip(lens.hessian(x, y + step, kwargs), lens.hessian(x, y - step, kwargs))
    ]
    for own, difference in [(f_xxx, along_x[0]), (f_xxy, along_y[0]), (f_xyy, along_y[1]), (f_yyy, along_y[3])]:
        np.testing.assert_allclose(own, difference, rtol=1e-5, atol=1e-6)


@pytest.mark.parametrize("name", LINES_OF_SIGHT)
def test_a_line_of_sight(name):
    names, kwargs = [name, "EPL", "SHEAR"], [LINES_OF_SIGHT[name], PROFILES["EPL"][0], PROFILES["SHEAR"][0]]
    cosmology = astropy_cosmology.FlatLambdaCDM(67.4, 0.315)
    redshifts = dict(z_lens=0.5, z_source=1.5)
    ours = hr.LensModel(names, **redshifts, cosmo=cosmology)
    theirs = lens_model.LensModel(names, **redshifts, cosmo=cosmology)
    close = dict(rtol=0.0, atol=1e-11)
    np.testing.assert_allclose(ours.ray_shooting(X, Y, kwargs), theirs.ray_shooting(X, Y, kwargs), **close)
    fermat = [model.fermat_potential(X, Y, kwargs) for model in (ours, theirs)]
    np.testing.assert_allclose(*fermat, rtol=1e-10, atol=1e-10)
    delays = [model.arrival_time(X, Y, kwargs) for model in (ours, theirs)]
    np.testing.assert_allclose(*delays, rtol=1e-8)
    # One profile alone: lenstronomy does not count the line of sight.
    np.testing.assert_allclose(ours.alpha(X, Y, kwargs, k=0), theirs.alpha(X, Y, kwargs, k=0), **close)
    np.testing.assert_allclose(ours.hessian(X, Y, kwargs), differences(theirs, kwargs), rtol=0, atol=1e-6)
    # The Hessian of lenstronomy's flexion models is not that of its α.
    if "FLEXION" not in name:
        np.testing.assert_allclose(ours.hessian(X, Y, kwargs), theirs.hessian(X, Y, kwargs), rtol=1e-10, atol=1e-10)
        magnifications = [model.magnification(X, Y, kwargs) for model in (ours, theirs)]
        np.testing.assert_allclose(*magnifications, rtol=1e-6)


def test_many_planes():
    names, redshifts = ["EPL", "NFW", "SHEAR"], [0.5, 0.3, 0.5]
    kwargs = [PROFILES[name][0] for name in names]
    cosmology = astropy_cosmology.FlatLambdaCDM(67.4, 0.315)
    settings = dict(z_source=1.5, lens_redshift_list=redshifts, multi_plane=True, cosmo=cosmology, z_lens=0.5)
    ours, theirs = hr.LensModel(names, **settings), lens_model.LensModel(names, **settings)
    np.testing.assert_allclose(ours.ray_shooting(X, Y, kwargs), theirs.ray_shooting(X, Y, kwargs), rtol=0, atol=1e-10)
    np.testing.assert_allclose(ours.hessian(X, Y, kwargs), theirs.hessian(X, Y, kwargs), rtol=1e-4, atol=1e-5)
    delays = [model.arrival_time(X, Y, kwargs) for model in (ours, theirs)]
    np.testing.assert_allclose(*(own - own[0] for own in delays), rtol=1e-7, atol=1e-6)
    fermat = [model.fermat_potential(X, Y, kwargs) for model in (ours, theirs)]
    np.testing.assert_allclose(*(own - own[0] for own in fermat), rtol=1e-7, atol=1e-6)


def test_shapes_are_those_that_come_in():
    lens, kwargs = hr.LensModel(["EPL"]), [PROFILES["EPL"][0]]
    assert isinstance(lens.kappa(1.0, 0.5, kwargs), float)
    assert lens.ray_shooting(np.ones((3, 2)), np.zeros((3, 2)), kwargs)[0].shape == (3, 2)
    assert lens.ray_shooting(1, np.float32(0), kwargs) == lens.ray_shooting(1.0, 0.0, kwargs)
    assert lens.alpha([], [], kwargs)[0].shape == (0,)
    one = lens.ray_shooting(1.0, 0.5, kwargs)
    assert one == tuple(own[0] for own in lens.ray_shooting(np.full(500, 1.0), np.full(500, 0.5), kwargs))


def test_quantities_are_converted():
    units = pytest.importorskip("astropy.units")
    lens, kwargs = hr.LensModel(["SIS"]), [{"theta_E": 1.4}]
    expected = lens.ray_shooting(1.0, 0.5, kwargs)
    angles = ((1.0 * units.arcsec).to(units.deg), (500.0 * units.mas))
    np.testing.assert_allclose(lens.ray_shooting(*angles, [{"theta_E": 1400.0 * units.mas}]), expected, rtol=1e-14)
    with pytest.raises(hr.InputError, match="arcsec"):
        lens.ray_shooting(1.0 * units.m, 0.5 * units.m, kwargs)


def test_images_and_curves_of_an_isothermal_sphere():
    lens, kwargs = hr.LensModel(["SIS"], z_lens=0.5, z_source=1.5), [{"theta_E": 1.4}]
    images = lens.point_source_images(0.5, 0.0, kwargs)
    assert images.is_complete and images.kind == ["minimum", "saddle"]
    np.testing.assert_allclose(images.theta_arcsec, [[1.9, 0.0], [-0.9, 0.0]], atol=1e-12)
    np.testing.assert_allclose(images.magnification, [1.9 / 0.5, -0.9 / 0.5], rtol=1e-10)
    assert images.delay_days[0] == 0.0 and images.delay_days[1] > 0.0
    np.testing.assert_allclose(lens.einstein_radius(kwargs), 1.4, rtol=1e-12)
    (curve,) = lens.critical_curves(kwargs)
    np.testing.assert_allclose(np.hypot(*curve.theta_arcsec.T), 1.4, rtol=1e-10)


def test_the_numbers_of_a_sight_are_those_of_its_models():
    sight = hr.LineOfSight(hr.populate(SMALL, seed=3), reference="straight")
    effective = sight.effective(0.5)
    full, minimal = effective.kwargs("LOS"), effective.kwargs("LOS_MINIMAL")
    lens_kwargs = PROFILES["EPL"][0]
    for name in hr.LENS_MODELS:
        if name.startswith("LOS"):
            beta = hr.LensModel([name, "EPL"]).ray_shooting(1.2, 0.3, [effective.kwargs(name), lens_kwargs])
            assert np.all(np.isfinite(beta))
    a_od, a_os, a_ds = (own.jacobian() for own in (effective.od, effective.os, effective.ds))
    np.testing.assert_allclose(effective.los.jacobian(), a_od.T @ np.linalg.inv(a_ds) @ a_os, atol=1e-14)
    assert full["gamma1_od"] == minimal["gamma1_od"]
    # Without a lens the full model is the Jacobian of the sight.
    np.testing.assert_allclose(sight.jacobian(0.0, 0.0), a_os, atol=1e-13)


def test_what_lenstronomy_refuses_is_refused():
    for names, options in [
        (["LOS", "LOS_MINIMAL"], {}),
        (["LOS", "EPL"], {"multi_plane": True, "z_source": 1.5, "lens_redshift_list": [0.5, 0.5]}),
    ]:
        with pytest.raises(hr.InputError, match="lens_model_list is"):
            hr.LensModel(names, **options)
    lens = hr.LensModel(["SIS"], z_lens=0.5, z_source=1.5)
    with pytest.raises(hr.InputError, match="diff_method is 'bad'"):
        lens.hessian(1.0, 0.5, [{"theta_E": 1.0}], diff_method="bad")
    lens.change_source_redshift(1.5)
    with pytest.raises(NotImplementedError):
        lens.change_source_redshift(2.0)


def test_lenstronomys_analytical_solver_takes_the_model():
    solver = pytest.importorskip("lenstronomy.LensModel.Solver.lens_equation_solver")
    lens, kwargs = (
        hr.LensModel(["EPL"]),
        [{"theta_E": 1.2, "gamma": 2.1, "e1": 0.1, "e2": 0.05, "center_x": 0.0, "center_y": 0.0}],
    )
    x, y = solver.LensEquationSolver(lens).image_position_from_source(0.05, 0.02, kwargs, solver="analytical")
    images = lens.point_source_images(0.05, 0.02, kwargs)
    assert len(x) == 4 == len(images.theta_arcsec)
    assert sorted(x) == pytest.approx(sorted(images.theta_arcsec[:, 0]), abs=1e-9)
