"""Figures: each is drawn from what is saved, shows what it should, and goes into axes of the user's own."""

import numpy as np
import pytest
from conftest import SMALL

import haloray as hr

matplotlib = pytest.importorskip("matplotlib")
matplotlib.use("Agg")
from matplotlib import pyplot  # noqa: E402

TINY = {**SMALL, "image": {"pixels": 48}, "maps": {"points": 9}, "diagnostics": {"critical_curves": True}}


@pytest.fixture(autouse=True)
def close():
    yield
    pyplot.close("all")


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    folder = tmp_path_factory.mktemp("figures") / "run"
    hr.simulate(TINY, seed=3, output=folder)
    return folder


@pytest.fixture(scope="module")
def ensemble():
    return hr.ensemble(SMALL, 30, seed=3)


def test_a_run(run):
    pair = hr.figures.images(run)
    noisy = hr.read(run / "run.h5").groups["images"]["all_haloes"]["noisy"]
    shown = [ax.images[0].get_array() for ax in pair.axes if ax.images]
    assert len(shown) == 6 and np.array_equal(shown[3], noisy)
    assert any(len(ax.lines) for ax in pair.axes), "critical curves"
    maps = hr.figures.tidal_maps(run)
    assert sum("white: axis" in ax.get_xlabel() for ax in maps.axes) == 3
    assert len(hr.figures.flexion_maps(str(run / "run.h5")).axes) == 6
    histogram = hr.figures.histograms(hr.read(run / "run.h5"))
    n = len(hr.read(run / "run.h5").haloes())
    assert sum(histogram.axes[0].patches[-1].get_data().values) == n
    ax = pyplot.figure().add_subplot()
    assert hr.figures.cylinder(run, ax, stride=1) is ax
    assert sum(len(line.get_xdata()) for line in ax.lines[:2]) == n
    assert hr.figures.mass_function(run).get_legend() is not None


def test_maps_of_a_sight(sight):
    pytest.importorskip("xarray")
    maps = sight.maps(points=7, half_width_arcsec=1.5)
    figure = hr.figures.tidal_maps(maps, einstein_radius_arcsec=1.0)
    extent = figure.axes[0].images[0].get_extent()
    assert extent == pytest.approx([-1.75, 1.75, -1.75, 1.75]) and figure.axes[0].patches


def test_an_ensemble(ensemble, tmp_path):
    figure = hr.figures.distributions(ensemble)
    assert [ax.get_legend() is not None for ax in figure.axes] == [True] * 4
    pytest.importorskip("h5netcdf")
    ensemble.write(tmp_path / "ensemble")
    joint = hr.figures.joint(tmp_path / "ensemble")
    assert len(joint.axes) == 36 and joint.axes[0].texts[0].get_text().startswith("γ$_{\\mathrm{1}}")
    ax = hr.figures.settling(ensemble.to_xarray())
    gamma = np.hypot(ensemble["gamma1_los"], ensemble["gamma2_los"])
    assert ax.lines[0].get_ydata()[-1] == pytest.approx(np.sqrt(np.mean(gamma**2)))


def test_a_lens():
    lens, kwargs = hr.LensModel(["EPL"]), [{"theta_E": 1.2, "gamma": 2.0, "e1": 0.1, "e2": 0.0}]
    curves = lens.critical_curves(kwargs)
    figure = hr.figures.curves(curves, lens.point_source_images(0.05, 0.02, kwargs), (0.05, 0.02))
    assert len(figure.axes) == 2 and len(figure.axes[0].lines[-1].get_xdata()) == 4
    _, ax = pyplot.subplots()
    ax.set(xlim=(-3, 3), ylim=(-3, 3))
    assert hr.figures.overlay(curves, ax) is ax and ax.get_xlim() == (-3, 3)


def test_mocks_and_exposures():
    mock = hr.mock(3, seed=1)
    figure = hr.figures.mosaic(mock)
    assert [bool(ax.images) for ax in figure.axes] == [True, True, True, False]
    assert len(hr.figures.exposure(mock.images[0]).axes) == 3
    assert len(hr.figures.exposure(hr.image(TINY, seed=3)).axes) == 3


def test_a_density_is_that_of_its_draws():
    from haloray._drawing.density import curve, field, interval

    draws = np.random.default_rng(1).normal(2.0, 0.5, 20_000)
    x, density = curve(draws)
    normal = np.exp(-0.5 * ((x - 2.0) / 0.5) ** 2)
    assert np.abs(density - normal).max() < 0.06
    cut = draws[draws > 2.0]
    x, density = curve(cut)
    assert density[np.argmin(np.abs(x - 2.001))] > 0.9, "a density that is cut off keeps its height"
    _, _, values, (inner, outer) = field(draws, draws[::-1], (0.68, 0.95))
    share = [values[values > level].sum() / values.sum() for level in (inner, outer)]
    assert share == pytest.approx([0.68, 0.95], abs=0.01)
    assert interval(draws) == "2.00^{+0.49}_{−0.49}"


def test_a_posterior():
    rng = np.random.default_rng(2)
    posterior = hr.Posterior({"gamma1_los": rng.normal(size=(4, 300)), "lens.theta_E": rng.normal(size=(4, 300))}, {})
    figure = hr.figures.corner(posterior, truths={"gamma1_los": 0.1})
    assert len(figure.axes) == 4 and "LOS" in figure.axes[0].texts[0].get_text()
    both = hr.figures.corner({"a": posterior, "b": posterior}, ["gamma1_los"])
    assert [own.get_text() for own in both.axes[0].get_legend().get_texts()] == ["a", "b"]
    traces = hr.figures.trace(posterior)
    assert len(traces.axes) == 4 and len(traces.axes[0].lines) == 4
    fit = hr.Fit({}, posterior.posterior, {}, {}, *[np.zeros((1, 1))] * 2, "", np.zeros((1, 1)), 0.1, {})
    assert len(fit.plot_corner(truths={"gamma1_los": 0.1}).axes) == 4
    with pytest.raises(hr.InputError, match="none is no quantity"):
        hr.figures.corner(posterior, ["none"])


def test_studies():
    rng = np.random.default_rng(3)
    deviations = {f"deviation_{name}_sigma": rng.uniform(0.1, 5, 40) for name in ("axis", "ring")}
    ax = hr.figures.deviations(deviations)
    assert [own.get_text() for own in ax.get_legend().get_texts()] == ["axis", "ring"]
    names = ["kappa_os", "gamma1_os", "gamma2_os", "F1_os_per_arcsec", "F2_os_per_arcsec", "delta_tot"]
    columns = {name: rng.uniform(0.1, 1, 4) for name in [*names, "image_max_over_noise", "image_chi2"]}
    assert len(hr.figures.cut({"min_point_shear": 10.0 ** -np.arange(3, 7), **columns}).axes) == 2
    fits = {
        "model": np.array(["a", "a", "b"]),
        "productive": np.array([1.0, 1.0, 0.0]),
        "quality": np.array([1e4, 2e4, 1e4]),
        "sigma": np.array([0.01, 0.02, 0.1]),
        "residual_in_sigma": np.array([0.5, 1.5, 9.0]),
        **{f"gamma{i}_los_{end}": rng.normal(size=3) for i in (1, 2) for end in ("in", "out", "low", "high")},
    }
    assert len(hr.figures.recovery(fits).axes) == 3
    assert len(hr.figures.recovery_histograms(fits).axes) == 2
    assert len(hr.figures.recovery_quality(fits, lines=[(-0.5, 0.1, "line")]).axes) == 2
    parameter = {"name": "gamma1_los", "rank_counts": [5, 6, 4, 5], "p_value": 0.7, "coverage": 0.66}
    assert len(hr.figures.calibration({"parameters": [parameter] * 4}).axes) == 8
