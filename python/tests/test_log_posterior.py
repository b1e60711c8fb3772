"""The density for other samplers is that of the fit; its gradient is its slope."""

import numpy as np
import pytest
from test_fit import MODEL, observation

import haloray as hr


@pytest.fixture(scope="module")
def target():
    return hr.LogPosterior(observation(), MODEL, seed=3)


def test_it_is_what_a_fit_samples(target):
    fit = hr.fit(observation(), MODEL, seed=3)
    (mode,) = target.modes
    assert target.names == ("lens.theta_E", "source.center_x") and target.evaluations > 0
    assert target.quantities["lens.theta_E"] == "arcsec"
    draws = [
        target.latent({name: fit.posterior[name][chain, i] for name in target.names}) for chain in range(4) for i in range(9)
    ]
    lp = fit.sample_stats["lp"][:4, :9]
    assert target(np.reshape(draws, (4, 9, 2))) == pytest.approx(lp, abs=1e-6)
    assert target.log_likelihood(draws[0]) == pytest.approx(fit.sample_stats["log_likelihood"][0, 0], abs=1e-6)
    assert target(mode.latent) == pytest.approx(mode.log_density, abs=1e-9) and mode.log_density > lp.max()
    own = fit.parameters["lens.theta_E"]
    at_mode = target.values(mode.latent)
    assert at_mode["lens.theta_E"] == pytest.approx(own.best_fit, abs=1e-3 * own.standard_deviation)
    # The metric is the inverse covariance of a posterior as narrow as this one; the prior is flat and 1.5 wide.
    slope = (target.values(mode.latent + [1e-4, 0.0])["lens.theta_E"] - at_mode["lens.theta_E"]) / 1e-4
    deviation = slope * np.sqrt(np.linalg.inv(mode.metric)[0, 0])
    assert deviation == pytest.approx(own.standard_deviation, rel=0.15)


def test_the_gradient_is_the_slope(target):
    z = target.modes[0].latent + [[0.02, -0.01], [0.3, 0.2]]
    value, gradient = target.gradient(z)
    assert np.array_equal(value, target(z)) and gradient.shape == z.shape
    for i in range(2):
        step = 1e-5 * np.eye(2)[i]
        difference = (target(z + step) - target(z - step)) / 2e-5
        assert gradient[:, i] == pytest.approx(difference, rel=1e-4, abs=1e-3)
    assert np.array_equal(target(z[0]), value[0])


def test_points_and_parameters_that_cannot_be(target):
    for wrong in (0.0, [0.0], np.zeros((2, 3)), [0.0, np.nan], "no", [None, 1.0]):
        for call in (target, target.gradient, target.values, target.log_likelihood):
            with pytest.raises(hr.InputError, match="latent"):
                call(wrong)
    with pytest.raises(hr.InputError, match="lacks source"):
        target.latent({"lens.theta_E": 1.0})
    with pytest.raises(hr.InputError, match="has theta"):
        target.latent({"lens.theta_E": 1.0, "source.center_x": 0.0, "theta": 1.0})
    with pytest.raises(hr.InputError, match=r"lens.theta_E is 3, but must be from 0.5 to 2"):
        target.latent({"lens.theta_E": 3.0, "source.center_x": 0.0})
    assert target(np.zeros((0, 2))).shape == (0,)
