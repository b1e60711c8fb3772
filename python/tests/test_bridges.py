"""Bridges to other packages, each held to that package's own reader."""

import json

import numpy as np
import pytest
from conftest import SMALL

import haloray as hr

EPL = {"theta_E": 1.3, "gamma": 2.2, "e1": 0.15, "e2": -0.08, "center_x": 0.02, "center_y": -0.03}
SHEAR = {"gamma1": 0.03, "gamma2": -0.02}
SOURCE = {"amp": 2.0, "R_sersic": 0.4, "n_sersic": 1.5, "e1": -0.1, "e2": 0.2, "center_x": 0.05, "center_y": 0.1}


def written(path, **options):
    models = ["EPL", "SHEAR", "CONVERGENCE"], [EPL, SHEAR, {"kappa": 0.04}]
    lights = {"source_light_model_list": ["SERSIC_ELLIPSE"], "kwargs_source": [SOURCE]}
    hr.to_coolest(path, *models, z_lens=0.5, z_source=1.5, **lights, **options)


def test_coolest_reads_what_is_written(tmp_path):
    pytest.importorskip("coolest")
    from coolest.api.composable_models import ComposableLightModel, ComposableMassModel
    from coolest.template.json import JSONSerializer

    pixels = np.arange(1600.0).reshape(40, 40)
    written(tmp_path / "lens.json", image_e_s=pixels, pixel_scale_arcsec=0.1)
    template = JSONSerializer(str(tmp_path / "lens")).load(verbose=False)
    assert template.mode == "MAP" and template.cosmology.H0 == 67.4
    assert np.array_equal(template.observation.pixels.get_pixels(str(tmp_path)), pixels)
    masses = ComposableMassModel(template, str(tmp_path), entity_selection=[0, 1])
    x, y = np.meshgrid(np.linspace(-2, 2, 9), np.linspace(-2.1, 2.1, 8))
    lens = hr.LensModel(["EPL", "SHEAR", "CONVERGENCE"])
    expected = lens.alpha(x, y, [EPL, SHEAR, {"kappa": 0.04}])
    np.testing.assert_allclose(masses.evaluate_deflection(x, y), expected, atol=1e-9)
    light = ComposableLightModel(template, str(tmp_path), entity_selection=[2])
    lenstronomy = pytest.importorskip("lenstronomy.LightModel.light_model")
    flux = lenstronomy.LightModel(["SERSIC_ELLIPSE"]).surface_brightness(x, y, [SOURCE])
    # Its light is that of a pixel.
    np.testing.assert_allclose(light.evaluate_surface_brightness(x, y), 0.1**2 * flux, rtol=1e-6)


def test_coolest_there_and_back(tmp_path):
    pytest.importorskip("coolest")
    written(tmp_path / "lens.json", cosmology=(70.0, 0.3))
    found = hr.from_coolest(tmp_path / "lens.json")
    assert found.lens_model_list == ["SHEAR", "CONVERGENCE", "EPL"]
    for own, expected in zip(found.kwargs_lens, [SHEAR, {"kappa": 0.04}, EPL]):
        assert own == pytest.approx(expected, abs=1e-13)
    assert found.kwargs_source[0] == pytest.approx(SOURCE, abs=1e-13)
    assert (found.z_lens, found.z_source, found.cosmology) == (0.5, 1.5, (70.0, 0.3))
    x, y = np.array([1.0, -0.4]), np.array([0.3, 1.6])
    again = found.lens_model().ray_shooting(x, y, found.kwargs_lens)
    np.testing.assert_allclose(
        again,
        hr.LensModel(["EPL", "SHEAR", "CONVERGENCE"]).ray_shooting(x, y, [EPL, SHEAR, {"kappa": 0.04}]),
        atol=1e-13,
    )


def test_position_angles_of_coolest():
    from haloray._coolest import components, position_angle_deg

    # Along x: 90° from north; along y: 0°; towards upper left, east of north: 45°.
    assert position_angle_deg(0.1, 0.0) == 90.0 and position_angle_deg(-0.1, 0.0) == 0.0
    assert position_angle_deg(0.0, -0.1) == pytest.approx(45.0)
    assert components(0.1, 45.0) == pytest.approx((0.0, -0.1))


def test_coolest_refuses_what_it_has_not(tmp_path):
    options = {"z_lens": 0.5, "z_source": 1.5}
    pytest.importorskip("coolest")
    with pytest.raises(hr.InputError, match="'LOS_MINIMAL', but must be one that COOLEST has"):
        hr.to_coolest(tmp_path / "a.json", ["LOS_MINIMAL"], [{}], **options)
    with pytest.raises(hr.InputError, match="about the origin"):
        hr.to_coolest(tmp_path / "a.json", ["SHEAR"], [{**SHEAR, "ra_0": 1.0}], **options)
    (tmp_path / "b.json").write_text("{}")
    with pytest.raises(hr.InputError, match="no COOLEST template"):
        hr.from_coolest(tmp_path / "b.json")
    with pytest.raises(FileNotFoundError):
        hr.from_coolest(tmp_path / "none.json")
    written(tmp_path / "c.json")
    content = json.loads((tmp_path / "c.json").read_text())
    content["lensing_entities"][1]["mass_model"][0]["parameters"]["q"]["point_estimate"]["value"] = None
    (tmp_path / "c.json").write_text(json.dumps(content))
    with pytest.raises(hr.InputError, match="q of PEMD has no point estimate"):
        hr.from_coolest(tmp_path / "c.json")


def test_decoupled_multiplane_of_lenstronomy(sight):
    lens_model = pytest.importorskip("lenstronomy.LensModel.lens_model")
    cosmology = pytest.importorskip("astropy.cosmology").FlatLambdaCDM(67.4, 0.315)
    fiducial = (0.5, "EPL", EPL)
    tables = sight.to_decoupled_multiplane(fiducial, 2.0, 81)
    theirs = lens_model.LensModel(
        ["EPL"],
        lens_redshift_list=[0.5],
        z_source=1.5,
        multi_plane=True,
        decouple_multi_plane=True,
        kwargs_multiplane_model=tables.kwargs,
        cosmo=cosmology,
    )
    random = np.random.default_rng(4)
    x, y = random.uniform(-1.9, 1.9, (2, 200))
    for arguments in (EPL, {**EPL, "theta_E": 1.35, "e1": 0.1}):
        own = tables.ray_shooting(x, y, (0.5, "EPL", arguments))
        np.testing.assert_allclose(theirs.ray_shooting(x, y, [arguments]), own, atol=1e-10)
    far = np.hypot(x - EPL["center_x"], y - EPL["center_y"]) > 0.3
    traced = sight.ray_shooting(x, y, lens=fiducial)
    beta = theirs.ray_shooting(x, y, [EPL])
    assert np.hypot(beta[0] - traced[0], beta[1] - traced[1])[far].max() <= 1.5 * tables.error_arcsec
    finer = sight.to_decoupled_multiplane(fiducial, 2.0, 161)
    assert finer.error(x[far], y[far]).max() < 0.5 * tables.error(x[far], y[far]).max()
    other = tables.error(x[far], y[far], (0.5, "EPL", {**EPL, "theta_E": 1.35}))
    assert np.median(tables.error(x[far], y[far])) < np.median(other) and other.max() < 0.01


def test_decoupled_without_haloes_is_the_lens():
    none = {"z": [0.3], "theta_x_arcsec": [50.0], "theta_y_arcsec": [0.0], "m200c_msun": [1e6], "c200c": [5.0]}
    pytest.importorskip("scipy")
    tables = hr.LineOfSight(none, 1.5).to_decoupled_multiplane((0.5, "EPL", EPL), 2.0, 5)
    other = {**EPL, "theta_E": 0.9}
    x, y = np.array([1.2, -0.4, 0.7]), np.array([0.3, 0.9, -1.1])
    alone = hr.LensModel(["EPL"]).ray_shooting(x, y, [other])
    np.testing.assert_allclose(tables.ray_shooting(x, y, (0.5, "EPL", other)), alone, atol=2e-6)


def test_lenstronomys_image_and_psf_are_taken():
    image_data = pytest.importorskip("lenstronomy.Data.imaging_data")
    pixels = np.random.default_rng(1).normal(size=(21, 21))
    kwargs = {
        "image_data": pixels,
        "background_rms": 0.01,
        "exposure_time": 900.0,
        "ra_at_xy_0": -0.8,
        "dec_at_xy_0": -0.8,
        "transform_pix2angle": np.array([[0.08, 0.0], [0.0, 0.08]]),
    }
    theirs = image_data.ImageData(**kwargs)
    own = hr.Observation.from_lenstronomy(kwargs, {"psf_type": "GAUSSIAN", "fwhm": 0.1, "truncation": 3})
    assert np.array_equal(own.data_e_s, theirs.data) and own.pixel_scale_arcsec == pytest.approx(theirs.pixel_width)
    with pytest.raises(hr.InputError, match="ra_at_xy_0"):
        hr.Observation.from_lenstronomy({**kwargs, "ra_at_xy_0": 0.0}, {"psf_type": "NONE"})
    with pytest.raises(hr.InputError, match="noise_map"):
        hr.Observation.from_lenstronomy({**kwargs, "noise_map": pixels}, {"psf_type": "NONE"})


def test_saved_results_as_data_sets(tmp_path):
    xarray = pytest.importorskip("xarray")
    small = {**SMALL, "image": {"pixels": 16}, "maps": {"points": 9}}
    simulation = hr.simulate(small, seed=3, output=tmp_path / "run")
    tree = hr.open_run(tmp_path / "run")
    assert isinstance(tree, xarray.DataTree)
    assert np.array_equal(tree["haloes"].chi_cmpc, simulation.haloes.chi_cmpc)
    assert tree["haloes"].chi_cmpc.attrs["units"] == "Mpc"
    maps = tree["maps"].ds
    assert maps.kappa.sel(theta_x=0, theta_y=0, method="nearest") == pytest.approx(maps.attrs["kappa_on_axis"])
    own = simulation.summary["all_haloes"]["gamma1_los"]
    assert tree["diagnostics/all_haloes"].attrs["gamma1_los"] == own
    image = tree["images/all_haloes"].noisy
    assert np.array_equal(image, simulation.all_haloes.noisy_e_s) and float(image.x[0]) == pytest.approx(-7.5 * 0.08)
    pytest.importorskip("h5netcdf")
    ensemble = hr.ensemble(small, 3, seed=3)
    ensemble.write(tmp_path / "ensemble")
    opened = hr.open_ensemble(tmp_path / "ensemble")
    assert np.array_equal(opened.gamma1_los, ensemble["gamma1_los"])
    with pytest.raises(FileNotFoundError):
        hr.open_ensemble(tmp_path / "none.h5")
    with pytest.raises(hr.InputError, match="no posterior"):
        hr.open_posterior(tmp_path / "run" / "run.h5")


LENSES = {"z_lens": [0.52, 0.3, 1.46], "z_source": [1.5, 2.04, 1.54]}


@pytest.fixture(scope="module")
def sightlines():
    few = {"haloes": {"min_point_shear": 3e-4}}
    return [hr.ensemble(few, 4, seed=3, lenses=LENSES), hr.ensemble(few, 5, seed=4)]


def test_slsim_draws_what_is_written(sightlines, tmp_path):
    pytest.importorskip("slsim")
    from slsim.LOS.los_pop import LOSPop
    from slsim.Util.ParamDistributions.kext_gext_distributions import LineOfSightDistribution as Reader

    hr.to_slsim(tmp_path / "los.h5", sightlines)
    hr.to_slsim(tmp_path / "os.h5", sightlines, corrected=False, place="ring")
    paths = {"nonlinear_correction_path": str(tmp_path / "los.h5"), "no_correction_path": str(tmp_path / "os.h5")}
    # slsim reads its tables once.
    Reader.correction_data = Reader.no_nonlinear_correction_data = None
    of_lens, alone = sightlines
    np.random.seed(1)
    for nonlinear, end in ((True, "los"), (False, "os_beam")):
        population = LOSPop(nonlinear_los_bool=nonlinear, **paths)
        for lens in range(3):
            rows = of_lens["lens"] == lens
            drawn = [population.draw_los(LENSES["z_source"][lens], LENSES["z_lens"][lens]) for _ in range(300)]
            kappa, gamma = of_lens[f"kappa_{end}"][rows], np.hypot(*(of_lens[f"gamma{i}_{end}"][rows] for i in (1, 2)))
            # The other ensemble and, without correction, the last lens have the source of the first.
            if lens == 0 or (not nonlinear and lens == 2):
                others = [alone[f"{name}_{end}"] for name in ("kappa", "gamma1", "gamma2")]
                kappa, gamma = np.append(kappa, others[0]), np.append(gamma, np.hypot(*others[1:]))
            if not nonlinear and lens != 1:
                rows = of_lens["lens"] == 2 - lens
                kappa = np.append(kappa, of_lens[f"kappa_{end}"][rows])
                gamma = np.append(gamma, np.hypot(*(of_lens[f"gamma{i}_{end}"][rows] for i in (1, 2))))
            assert {float(own.convergence) for own in drawn} == set(kappa.tolist())
            found = np.unique(np.round([np.hypot(*own.shear) for own in drawn], 12))
            np.testing.assert_allclose(found, np.unique(np.round(gamma, 12)), rtol=0, atol=2e-12)


def test_tables_of_slsim_there_and_back(sightlines, tmp_path):
    h5py = pytest.importorskip("h5py")
    hr.to_slsim(tmp_path / "los.h5", sightlines, place="ring")
    found = hr.from_slsim(tmp_path / "los.h5")
    # A lens and a source of the same tenth are a tenth apart, as slsim looks for them.
    assert list(found) == [(1.5, 0.5), (1.5, 1.4), (2.0, 0.3)]
    assert [len(own) for own in found.values()] == [4 + 5, 4, 4]
    own = sightlines[0]
    rows = own["lens"] == 1
    assert np.array_equal(found[2.0, 0.3][:, 0], own["kappa_los_ring"][rows])
    assert np.array_equal(found[2.0, 0.3][:, 1], np.hypot(own["gamma1_los_ring"][rows], own["gamma2_los_ring"][rows]))
    hr.to_slsim(tmp_path / "os.h5", sightlines[1], corrected=False)
    ((redshifts, table),) = hr.from_slsim(tmp_path / "os.h5").items()
    assert redshifts == (1.5, None) and np.array_equal(table[:, 0], sightlines[1]["kappa_os"])
    # Tables of slsim's own may have more columns.
    with h5py.File(tmp_path / "more.h5", "w") as file:
        file["zs_0.4_zd_0.1"] = np.arange(6.0).reshape(2, 3)
    assert hr.from_slsim(tmp_path / "more.h5")[0.4, 0.1].tolist() == [[0.0, 1.0], [3.0, 4.0]]


def test_what_is_no_table_of_slsim_is_refused(sightlines, tmp_path):
    h5py = pytest.importorskip("h5py")
    with pytest.raises(hr.InputError, match="place is 'disc'"):
        hr.to_slsim(tmp_path / "a.h5", sightlines, place="disc")
    with pytest.raises(hr.InputError, match="ensembles are none"):
        hr.to_slsim(tmp_path / "a.h5", [])
    with pytest.raises(hr.InputError, match="a haloray.Ensemble"):
        hr.to_slsim(tmp_path / "a.h5", ["paper"])
    far = hr.ensemble({"haloes": {"min_point_shear": 1e-2}}, 1, lenses={"z_lens": [0.5], "z_source": [6.0]})
    with pytest.raises(hr.InputError, match="z_source of the ensemble is 6.0, but must be from 0.05 to 4.95"):
        hr.to_slsim(tmp_path / "a.h5", far)
    with pytest.raises(hr.FileError, match="cannot write"):
        hr.to_slsim(tmp_path / "none" / "a.h5", sightlines)
    assert not list(tmp_path.iterdir())
    with pytest.raises(FileNotFoundError):
        hr.from_slsim(tmp_path / "a.h5")
    (tmp_path / "b.h5").write_text("text")
    with pytest.raises(hr.InputError, match="no table of slsim"):
        hr.from_slsim(tmp_path / "b.h5")
    with h5py.File(tmp_path / "c.h5", "w") as file:
        file["haloes"] = np.zeros(3)
    with pytest.raises(hr.InputError, match="it holds haloes"):
        hr.from_slsim(tmp_path / "c.h5")
