"""What users hand over that means something else than it seems: converted, kept or refused, never taken for something else."""

import copy
import pickle

import numpy as np
import pytest

import haloray as hr

HALOES = {
    "z": [0.3, 0.5],
    "theta_x_arcsec": [1.0, 2.0],
    "theta_y_arcsec": [1.0, 2.0],
    "m200c_msun": [1e12, 1e12],
    "c200c": [10.0, 11.0],
}
EPL = {"theta_E": 1.4, "gamma": 2.1, "e1": 0.1, "e2": -0.2}


@pytest.fixture
def haloes():
    return hr.Haloes.from_columns(HALOES, 1.5)


def test_quantities_are_converted_to_the_unit_of_their_argument_or_refused():
    u = pytest.importorskip("astropy.units")
    shear = hr.LensModel(["SHEAR_GAMMA_PSI"])
    in_degrees = shear.alpha(1.0, 0.0, [{"gamma_ext": 0.1, "psi_ext": 30 * u.deg}])
    assert in_degrees == pytest.approx(shear.alpha(1.0, 0.0, [{"gamma_ext": 0.1, "psi_ext": np.pi / 6}]), abs=1e-15)
    flexion = [{"g1": 0.01 / u.arcsec, "g2": 0.0, "g3": 0.0, "g4": 0.0}]
    assert hr.LensModel(["FLEXION"]).alpha(1.0, 0.0, flexion)[0] == pytest.approx(0.005)
    with pytest.raises(hr.InputError, match="gamma is .* no unit"):
        hr.LensModel(["EPL"]).alpha(1.0, 0.0, [{**EPL, "gamma": 2.2 * u.arcsec}])
    with pytest.raises(hr.InputError, match="foo of EPL"):
        hr.LensModel(["EPL"]).alpha(1.0, 0.0, [{**EPL, "foo": 1.0 * u.m}])
    assert list(hr.Haloes.from_columns({**HALOES, "c200c": [1000, 1100] * u.percent}, 1.5).c200c) == [10.0, 11.0]
    with pytest.raises(hr.InputError, match="z is .* no unit"):
        hr.Haloes.from_columns({**HALOES, "z": [0.3, 0.5] * u.m}, 1.5)


def test_angles_of_another_source_or_cosmology_are_refused(haloes):
    pytest.importorskip("astropy")
    table = haloes.to_table()
    assert hr.Haloes.from_table(table, 1.5) == haloes
    with pytest.raises(hr.InputError, match=r"z_source is 3.0, but must be 1.5"):
        hr.Haloes.from_table(table, 3.0)
    for source, cosmology in [(3.0, None), (1.5, (50.0, 0.3))]:
        with pytest.raises(hr.InputError, match="another cosmology"):
            hr.Haloes.from_columns(haloes.to_dict(), source, cosmology)
    assert haloes.to_source(3.0).alpha_rs_arcsec[0] > haloes.alpha_rs_arcsec[0]


def test_haloes_are_chosen_as_numpy_chooses(haloes):
    for key in ([1, 0, 1], slice(None, None, -1), [True, False], -1, np.array([1]), np.array([], dtype=int)):
        assert np.array_equal(haloes[key].z, np.atleast_1d(np.asarray(HALOES["z"])[key])), key
    assert len(haloes[[]]) == 0
    for key in (None, True, 2, [[0, 1]]):
        with pytest.raises(hr.InputError):
            haloes[key]
    for whole in (haloes, hr.mock(1, seed=1)):
        with pytest.raises(TypeError, match="not iterable"):
            list(whole)
    with pytest.raises(AttributeError, match="read-only"):
        haloes.z = np.zeros(2)


def test_columns_of_ones_own_are_kept_to_the_last_digit():
    pandas = pytest.importorskip("pandas")
    own = {"id": [2**60 + 1, 2], "host": [True, False], "day": pandas.to_datetime(["2020-01-01", "2021-01-01"])}
    frame = pandas.DataFrame({**HALOES, **own, "z": np.array([0.3, 0.5], object), "small": [1, 2]})
    kept = hr.Haloes.from_dataframe(frame, 1.5).to_dict()
    assert kept["id"] == ["1152921504606846977", "2"] and kept["host"] == ["True", "False"]
    assert kept["day"][0].startswith("2020-01-01") and list(kept["small"]) == [1.0, 2.0]
    assert list(kept["z"]) == [0.3, 0.5]


@pytest.mark.parametrize("z", [np.nan, -1.0, 0.0, np.inf])
def test_what_is_no_redshift_is_refused_at_once(haloes, z):
    for call in (
        lambda: haloes.to_source(z),
        lambda: hr.LineOfSight(haloes, z_source=z),
        lambda: hr.Haloes.from_columns({name: [] for name in HALOES}, z),
        lambda: hr.LensModel(["SIS"], z_lens=z, z_source=2.0),
        lambda: hr.Observation(np.ones((8, 8)), pixel_scale_arcsec=0.1, background_rms_e_s=1, exposure_s=1, z_lens=z),
    ):
        with pytest.raises(hr.InputError, match=r"z_(source|lens) is"):
            call()


def test_an_empty_model_and_an_empty_choice_bend_nothing():
    assert hr.LensModel([]).ray_shooting(1.0, 2.0, []) == (1.0, 2.0)
    for none in ([], [False]):
        assert hr.LensModel(["EPL"]).ray_shooting(1.0, 0.5, [EPL], k=none) == (1.0, 0.5)
    with pytest.raises(hr.InputError, match="length of kwargs_lens is 0, but must be 1"):
        hr.LensModel(["EPL"]).ray_shooting(1.0, 0.5, [])


def test_small_windows_and_planes_behind_the_source_are_told_of():
    for half_width in (1e-5, 1e-9):
        assert hr.LensModel(["EPL"]).critical_curves([EPL], half_width) == []
    two = hr.LensModel(["SIS", "SIS"], z_source=1.5, lens_redshift_list=[0.5, 1.6], multi_plane=True)
    assert "SIS at z = 1.6 is not before the source" in two.warnings([{"theta_E": 1.0}] * 2)[0]


def test_haloes_behind_the_source_are_left_out_with_a_warning():
    columns = {
        "z": np.array([0.5, 1.5, 3.0]),
        "theta_x_arcsec": np.arange(3.0),
        "theta_y_arcsec": np.zeros(3),
        "m200c_msun": np.full(3, 1e12),
        "c200c": np.full(3, 8.0),
        "name": ["a", "b", "c"],
    }
    with pytest.warns(UserWarning, match="2 of 3 haloes at or behind the source"):
        haloes = hr.Haloes.from_columns(columns, z_source=1.5)
    assert len(haloes) == 1 and haloes["z"].tolist() == [0.5] and haloes.to_table()["name"].tolist() == ["a"]
    assert columns["z"].tolist() == [0.5, 1.5, 3.0], "the user's own is as it was"
    with pytest.warns(UserWarning, match="are these logarithms"):
        hr.Haloes.from_columns({**columns, "m200c_msun": np.full(3, 12.0)}, z_source=4.0)
    many = {name: np.repeat(values, 10) for name, values in columns.items()}
    with pytest.warns(UserWarning, match="are they RA and Dec"):
        hr.Haloes.from_columns({**many, "theta_x_arcsec": np.linspace(150.1, 150.2, 30)}, z_source=4.0)


def test_observations_pickle_and_results_compare():
    observation = hr.Observation(
        np.arange(64.0).reshape(8, 8), pixel_scale_arcsec=0.1, background_rms_e_s=1.0, exposure_s=1.0, psf_fwhm_arcsec=0.2
    )
    for other in (pickle.loads(pickle.dumps(observation)), copy.deepcopy(observation)):
        assert np.array_equal(other.data_e_s, observation.data_e_s) and "8 × 8 pixels" in repr(other)
    images = hr.LensModel(["EPL"]).point_source_images(0.1, 0.1, [EPL])
    assert images == images and images != hr.LensModel(["EPL"]).point_source_images(0.1, 0.1, [EPL]) and hash(images)


def test_wrong_matrices_axes_and_truths_are_named():
    data = {"image_data": np.ones((8, 8)), "background_rms": 1.0, "exposure_time": 1.0}
    for transform in (0.08, np.eye(3)):
        with pytest.raises(hr.InputError, match="transform_pix2angle"):
            hr.Observation.from_lenstronomy({**data, "transform_pix2angle": transform}, {"psf_type": "NONE"})
    with pytest.raises(hr.InputError, match="observed_convention_index"):
        hr.LensModel(["EPL"], observed_convention_index=np.array([0, 1]))
    pytest.importorskip("matplotlib").use("Agg")
    with pytest.raises(hr.InputError, match="figure is .* Figure or SubFigure"):
        hr.figures.joint("anything", figure=[1])
