"""A small fit: the truth is found, the same seed gives the same draws, and results pickle."""

import importlib.util
import pickle
import sys

import numpy as np
import pytest

import haloray as hr

MODEL = """
name = "ring"
about = "An isothermal sphere and a round source."
pixel_sampling = "point"

[[lens]]
profile = "SIS"
[lens.parameters]
theta_E = { uniform = [0.5, 2.0] }

[[source]]
profile = "SERSIC"
[source.parameters]
R_sersic = 0.2
n_sersic = 1.0
center_x = { uniform = [-0.3, 0.3] }
center_y = 0.0
"""


def observation():
    n, scale, rng = 16, 0.2, np.random.default_rng(4)
    axis = scale * (np.arange(n) - (n - 1) / 2)
    x, y = np.meshgrid(axis, axis)
    beta_x, beta_y = hr.LensModel(["SIS"]).ray_shooting(x, y, [{"theta_E": 1.1}])
    flux = 5.0 * np.exp(-1.6721 * (np.hypot(beta_x - 0.08, beta_y) / 0.2 - 1.0)) * scale**2
    noise = np.sqrt(0.01**2 + flux / 2000.0) * rng.normal(size=flux.shape)
    return hr.Observation(flux + noise, pixel_scale_arcsec=scale, background_rms_e_s=0.01, exposure_s=2000.0)


def test_a_fit(tmp_path):
    told = []
    fit = hr.fit(observation(), MODEL, seed=3, output=tmp_path / "fit", progress=lambda *what: told.append(what))
    assert fit.converged and fit.good_fit, fit.summary()
    for name, truth in [("lens.theta_E", 1.1), ("source.center_x", 0.08)]:
        own = fit.parameters[name]
        assert abs(own.median - truth) < 5.0 * own.standard_deviation and own.standard_deviation < 0.01
        assert np.median(fit.posterior[name]) == pytest.approx(own.median)
    assert fit.posterior["lens.theta_E"].shape == fit.sample_stats["lp"].shape
    assert "lens.theta_E" in fit.summary() and told
    again = pickle.loads(pickle.dumps(fit))
    assert np.array_equal(again.model_e_s, fit.model_e_s) and again.parameters == fit.parameters
    posterior = hr.read(tmp_path / "fit" / "posterior.nc")
    assert np.array_equal(posterior.posterior["lens.theta_E"], fit.posterior["lens.theta_E"])
    if importlib.util.find_spec("arviz") and importlib.util.find_spec("h5netcdf"):
        import arviz

        theirs = arviz.from_netcdf(tmp_path / "fit" / "posterior.nc")
        assert np.array_equal(theirs["posterior"]["lens.theta_E"].values, fit.posterior["lens.theta_E"])
    repeated = hr.fit(observation(), MODEL, seed=3)
    assert np.array_equal(repeated.posterior["lens.theta_E"], fit.posterior["lens.theta_E"])


class Stop(Exception):
    """What a user's own progress function raises, as Ctrl-C raises KeyboardInterrupt."""


def test_a_profile_of_a_parameter(tmp_path):
    fit = hr.fit(observation(), MODEL, seed=3, profile=["lens.theta_E"], output=tmp_path / "fit")
    (profile,) = fit.statistics["profiles"]
    own = fit.parameters["lens.theta_E"]
    low, high = profile["interval68"]
    # A nearly normal posterior: both intervals are one.
    assert high - low == pytest.approx(2.0 * own.standard_deviation, rel=0.2) and low < own.median < high
    assert max(profile["delta_log_likelihood"]) == 0.0 and len(profile["values"]) == len(profile["delta_log_likelihood"])
    if importlib.util.find_spec("matplotlib"):
        drawn = [hr.figures.profiles(own).axes[0].lines for own in (fit, tmp_path / "fit")]
        assert all(np.array_equal(one.get_data(), other.get_data()) for one, other in zip(*drawn))
    for wrong in ("lens.theta_E", ["theta"], [1], 3):
        with pytest.raises(hr.InputError):
            hr.fit(observation(), MODEL, profile=wrong)


def test_a_fit_that_was_stopped_goes_on(tmp_path):
    def stopped(after):
        def tell(task, done, units, message):
            nonlocal after
            after -= 1
            if after < 0:
                raise Stop

        return tell

    state, arguments = tmp_path / "state", {"seed": 3, "min_ess": 40_000.0, "sampler": "nuts"}
    whole = hr.fit(observation(), MODEL, **arguments)
    for after in (0, 1, 2):
        with pytest.raises(Stop):
            hr.fit(observation(), MODEL, **arguments, resume=state, progress=stopped(after))
    kept = state.read_bytes()
    with pytest.raises(hr.InputError, match="of another fit"):
        hr.fit(observation(), MODEL, seed=4, resume=state)
    assert state.read_bytes() == kept
    fit = hr.fit(observation(), MODEL, **arguments, resume=state)
    assert not state.exists()
    for name, draws in whole.posterior.items():
        assert np.array_equal(fit.posterior[name], draws)
    own = tmp_path / "notes.txt"
    own.write_text("forty-two numbers of my own that nobody else may write over")
    with pytest.raises(hr.InputError, match="of another format"):
        hr.fit(observation(), MODEL, resume=own)
    assert own.read_text().startswith("forty-two")


def test_models_are_told():
    names = dict(hr.models())
    assert "tidal-minimal" in names and "[[lens]]" in hr.model_text("tidal-minimal")
    with pytest.raises(hr.InputError, match="the model is none"):
        hr.fit(observation(), "none")
    with pytest.raises(hr.InputError, match="haloes"):
        hr.fit(observation(), "haloes")


def test_arviz_reads_summarises_and_plots():
    arviz, matplotlib = pytest.importorskip("arviz", "0.20"), pytest.importorskip("matplotlib")
    matplotlib.use("Agg")
    draws = np.random.default_rng(1).normal(size=(4, 500))
    found = hr.Posterior({"lens.theta_E": draws}, {"lens.theta_E": "arcsec"}).to_arviz()
    assert np.array_equal(found["posterior"]["lens.theta_E"].values, draws)
    is_old = arviz.__version__.startswith("0.")
    assert type(found).__name__ == ("InferenceData" if is_old else "DataTree")
    summary = arviz.summary(found) if is_old else arviz.summary(found, round_to="none")
    assert float(summary["r_hat"].iloc[0]) < 1.02 and float(summary["ess_bulk"].iloc[0]) > 400.0
    (arviz.plot_trace if is_old else arviz.plot_trace_dist)(found)
    matplotlib.pyplot.close("all")


def test_draws_go_to_what_arviz_1_reads(monkeypatch):
    stats, xarray = pytest.importorskip("arviz_stats"), pytest.importorskip("xarray")
    if not hasattr(stats, "summary"):
        pytest.skip("needs arviz-stats[xarray]")
    monkeypatch.setitem(sys.modules, "arviz", None)
    draws = np.random.default_rng(1).normal(size=(4, 500))
    found = hr.Posterior({"lens.theta_E": draws}, {"lens.theta_E": "arcsec"}).to_arviz()
    assert isinstance(found, xarray.DataTree)
    assert np.array_equal(found["posterior"]["lens.theta_E"].values, draws)
    assert float(stats.summary(found, round_to="none").loc["lens.theta_E", "r_hat"]) < 1.02
