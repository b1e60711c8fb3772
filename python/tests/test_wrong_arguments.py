"""Every public callable with one argument that is wrong: an exception that says so, or a right result; never an abort."""

import inspect

import numpy as np
import public
import pytest
import test_fit
from conftest import SMALL

import haloray as hr

pytest.importorskip("matplotlib").use("Agg")
pytest.importorskip("xarray")
pytest.importorskip("pandas")

KWARGS = {"theta_E": 1.4, "gamma": 2.1, "e1": 0.1, "e2": -0.05}
FEW = {"haloes": {"min_point_shear": 1e-3}, "image": {"pixels": 8}, "maps": {"points": 5}}
#: What calls may raise: errors that name the argument, and what haloray does not have or a package is missing for.
EXPECTED = (hr.Error, NotImplementedError, ImportError)
#: Figures take results; of what is none they may also say that it lacks something.
OF_FIGURES = (*EXPECTED, ArithmeticError, AttributeError, LookupError, OSError, TypeError, ValueError)


DEFINITIONS = ("axis", "ring", "light", "best_tidal", "best_flexion")
OF_VALIDITY = (
    *("sightline", "delta_tot", "delta_tot_ring", "residual_best_tidal_arcsec", "covariance_11", "covariance_12"),
    *(
        "covariance_22",
        "chi2",
        "p_value",
        "chi2_excess",
        "log_evidence",
        "h0_ratio_axis",
        "h0_ratio_ring",
        "h0_ratio_fit",
    ),
    *("halo_m200c_msun", "halo_z"),
)


def good(n=5):
    return np.linspace(0.5, 1.5, n)


def read_only(array):
    array.flags.writeable = False
    return array


#: What is wrong for most arguments, by a random generator.
BAD = [
    lambda r: r.normal(size=(2, 3)),
    lambda r: r.normal(size=4),
    lambda r: r.normal(size=0),
    lambda r: np.zeros((0, 0)),
    lambda r: np.full(5, np.nan),
    lambda r: np.where(np.arange(5) == r.integers(5), np.inf, 1.0),
    lambda r: np.full((8, 8), np.nan),
    lambda r: np.array(["a", "b", "c", "d", "e"]),
    lambda r: np.array([1 + 2j] * 5),
    lambda r: np.array([None] * 5, dtype=object),
    lambda r: np.zeros(5, dtype=[("a", float)]),
    lambda r: np.array(["2020-01-01"] * 5, dtype="datetime64[D]"),
    lambda r: np.ma.masked_array(good(), mask=[0, 1, 0, 0, 0]),
    lambda r: np.array([True] * 5),
    lambda r: read_only(r.normal(size=3)),
    lambda r: r.normal(size=(6, 3))[::2, ::-1],
    lambda r: r.normal(size=3).astype(">f8"),
    lambda r: [[1.0, 2.0], [3.0]],
    lambda r: [],
    lambda r: {},
    lambda r: {"a": 1.0},
    lambda r: [None],
    lambda r: "text",
    lambda r: "",
    lambda r: b"bytes",
    lambda r: object(),
    lambda r: range(3),
    lambda r: float("nan"),
    lambda r: float("inf"),
    lambda r: -1.0,
    lambda r: -1,
    lambda r: 1j,
    lambda r: -(10**400),
    lambda r: (1.0, 2.0, 3.0),
    lambda r: (0.5, "EPL", {**KWARGS, "theta_E": float("nan")}),
    lambda r: [{**KWARGS, "unknown": 1.0}],
    lambda r: [dict(list(KWARGS.items())[1:])],
    lambda r: hr.LensModel,
]
#: Arguments of which only truth counts, and those that say where something is written or told.
PLAIN = {
    "overwrite",
    "images",
    "noise_free",
    "hessian_diff",
    "multi_plane",
    "corrected",
    "diff",
    "progress",
    "figure",
    "ax",
}


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    """A result of every kind, small."""
    folder = tmp_path_factory.mktemp("results")
    simulation = hr.simulate(FEW, seed=3, output=folder / "run")
    ensemble = hr.ensemble(FEW, 3, seed=3)
    ensemble.write(folder / "ensemble")
    draws = np.random.default_rng(2).normal(size=(2, 40))
    zero = np.zeros((4, 4))
    profile = {"name": "gamma1_los", "unit": "", "best_fit": 0.0, "values": [-1.0, 0.0]}
    profile["delta_log_likelihood"] = [-2.0, 0.0]
    return {
        "folder": folder,
        "haloes": hr.populate(SMALL, seed=3),
        "sight": hr.LineOfSight(hr.populate(SMALL, seed=3)),
        "lens": hr.LensModel(["EPL"], 0.5, 1.5),
        "simulation": simulation,
        "ensemble": ensemble,
        "mock": hr.mock(2, seed=1),
        "posterior": hr.Posterior(
            {"gamma1_los": draws, "gamma2_los": draws[::-1]}, {"gamma1_los": "", "gamma2_los": ""}
        ),
        "fit": hr.Fit(
            {}, {"gamma1_los": draws}, {}, {"chi2_reduced": 1.0, "profiles": [profile]}, zero, zero, "", zero, 0.1, {}
        ),
        "target": hr.LogPosterior(test_fit.observation(), test_fit.MODEL),
        "run": hr.read(folder / "run" / "run.h5"),
    }


def calls(own):
    """The public callables with arguments that are right, by name."""
    sight, lens, haloes, folder = own["sight"], own["lens"], own["haloes"], own["folder"]
    columns = {name: good() for name in ("theta_x_arcsec", "theta_y_arcsec", "m200c_msun", "c200c")} | {"z": good() / 2}
    points, of_lens = {"x_arcsec": good(), "y_arcsec": good()}, {"x": good(), "y": good(), "kwargs": [KWARGS]}
    at_image = {"x_image": good(), "y_image": good(), "kwargs_lens": [KWARGS]}
    tables = sight.to_decoupled_multiplane((0.5, "EPL", KWARGS), 2.0, 5)
    way = {"z_from": None, "z_to": None, "lens": None}
    data = {"image_data": np.ones((8, 8)), "background_rms": 0.1, "exposure_time": 100.0}
    fits = {"model": ["a"], "productive": [1.0], "sigma": [0.1], "residual_in_sigma": [1.0]}
    fits |= {f"gamma{i}_los_{end}": [0.1] for i in (1, 2) for end in ("in", "out", "low", "high")}
    shears = {f"gamma{i}_los_{of}": [0.1] for i in (1, 2) for of in (*DEFINITIONS, "fit")}
    validity = {"case": ["base"], "haloes": ["all"], "mock": ["haloes"], "model": ["a"], "start": ["truth"], **shears}
    validity |= {name: [1.0] for name in OF_VALIDITY}
    smoothed = {"name": ["a"], "averaged_over": ["ring"], "radius_arcsec": [1.0]}
    smoothed |= {name: [0.1] for name in ("sigma_gamma_los", "sigma_gamma_los_error")}
    curve = hr.LensModel(["SIS"]).critical_curves([{"theta_E": 1.0}])
    observation = hr.Observation(np.ones((8, 8)), pixel_scale_arcsec=0.1, background_rms_e_s=0.1, exposure_s=100.0)
    ensemble_file, run = folder / "ensemble", folder / "run"
    return {
        "DecoupledMultiPlane.ray_shooting": (tables.ray_shooting, points),
        "DecoupledMultiPlane.error": (tables.error, points),
        "Effective.kwargs": (sight.effective(0.5).kwargs, {"model": "LOS"}),
        "Ensemble.to_xarray": (own["ensemble"].to_xarray, {"group": "sightlines"}),
        "Ensemble.write": (own["ensemble"].write, {"folder": "e"}),
        "Fit.plot_corner": (own["fit"].plot_corner, {"names": ["gamma1_los"]}),
        "Haloes": (hr.Haloes, {"native": haloes._native}),
        "Haloes.from_columns": (hr.Haloes.from_columns, {"columns": columns, "z_source": 1.5}),
        "Haloes.from_table": (hr.Haloes.from_table, {"table": haloes.to_table(), "z_source": 1.5}),
        "Haloes.from_dataframe": (hr.Haloes.from_dataframe, {"frame": haloes.to_dataframe(), "z_source": 1.5}),
        "Haloes.read": (hr.Haloes.read, {"path": run / "run.h5", "z_source": 1.5}),
        "Haloes.write": (haloes.write, {"path": "h.csv"}),
        "Haloes.effects": (haloes.effects, {"theta_e_arcsec": 1.0}),
        "Haloes.to_source": (haloes.to_source, {"z_source": 1.0}),
        "Haloes.__getitem__": (haloes.__getitem__, {"key": [0]}),
        "Image.write": (own["simulation"].all_haloes.write, {"path": "i.fits"}),
        "LensModel": (hr.LensModel, {"lens_model_list": ["EPL"], "z_lens": 0.5, "z_source": 1.5}),
        "LensModel.change_source_redshift": (lens.change_source_redshift, {"z_source": 1.5}),
        **{
            f"LensModel.{name}": (getattr(lens, name), of_lens)
            for name in (
                "ray_shooting",
                "alpha",
                "hessian",
                "kappa",
                "curl",
                "gamma",
                "magnification",
                "flexion",
                "potential",
            )
        },
        "LensModel.fermat_potential": (lens.fermat_potential, at_image),
        "LensModel.arrival_time": (lens.arrival_time, at_image),
        "LensModel.point_source_images": (
            lens.point_source_images,
            {"x_source": 0.1, "y_source": 0.0, "kwargs": [KWARGS]},
        ),
        "LensModel.critical_curves": (lens.critical_curves, {"kwargs": [KWARGS]}),
        "LensModel.einstein_radius": (lens.einstein_radius, {"kwargs": [KWARGS]}),
        "LensModel.warnings": (lens.warnings, {"kwargs": [KWARGS]}),
        "LensModel.check_parameters": (lens.check_parameters, {"kwargs_list": [KWARGS]}),
        "LensModel.set_static": (hr.LensModel(["EPL"]).set_static, {"kwargs": [KWARGS]}),
        "LineOfSight": (hr.LineOfSight, {"haloes": haloes}),
        "LineOfSight.trace": (sight.trace, points),
        **{
            f"LineOfSight.{name}": (getattr(sight, name), {**points, **way})
            for name in ("ray_shooting", "alpha", "jacobian", "hessian", "flexion", "arrival_time")
        },
        "LineOfSight.effective": (sight.effective, {"z_lens": 0.5}),
        "LineOfSight.maps": (sight.maps, {"points": 3, "half_width_arcsec": 1.0}),
        "LineOfSight.to_interpol": (sight.to_interpol, {"half_width_arcsec": 1.0, "n": 5}),
        "LineOfSight.to_decoupled_multiplane": (
            sight.to_decoupled_multiplane,
            {"lens": (0.5, "EPL", KWARGS), "half_width_arcsec": 1.0, "n": 5},
        ),
        "LogPosterior": (hr.LogPosterior, {"image": observation, "model": "no"}),
        **{
            f"LogPosterior.{name}": (getattr(own["target"], name), {"latent": np.zeros(len(own["target"].names))})
            for name in ("__call__", "gradient", "log_likelihood", "values")
        },
        "LogPosterior.latent": (own["target"].latent, {"values": own["target"].values(own["target"].modes[0].latent)}),
        "Observation": (
            hr.Observation,
            {"data_e_s": np.ones((8, 8)), "pixel_scale_arcsec": 0.1, "background_rms_e_s": 0.1, "exposure_s": 100.0},
        ),
        "Observation.read": (hr.Observation.read, {"path": run / "image_all_haloes.fits"}),
        "Observation.from_lenstronomy": (hr.Observation.from_lenstronomy, {"kwargs_data": data, "kwargs_psf": {}}),
        "Run.setting": (own["run"].setting, {"section": "lens", "key": "einstein_radius_arcsec"}),
        "config": (hr.config, {"config": FEW}),
        "ensemble": (hr.ensemble, {"config": FEW, "n": 1}),
        "fit": (hr.fit, {"image": observation, "model": "no"}),
        "from_coolest": (hr.from_coolest, {"path": "none.json"}),
        "from_lens_models": (
            hr.from_lens_models,
            {"models": ["NFW"], "redshifts": [0.5], "kwargs": [{"Rs": 1.0, "alpha_Rs": 0.1}], "z_source": 1.5},
        ),
        "from_pyhalo": (hr.from_pyhalo, {"realization": None}),
        "from_slsim": (hr.from_slsim, {"path": "none.h5"}),
        "image": (hr.image, {"config": FEW}),
        "mock": (hr.mock, {"n": 1, "images": False}),
        "model_text": (hr.model_text, {"name": "tidal-minimal"}),
        "open_ensemble": (hr.open_ensemble, {"path": ensemble_file}),
        "open_posterior": (hr.open_posterior, {"path": "none.nc"}),
        "open_run": (hr.open_run, {"path": run}),
        "populate": (hr.populate, {"config": FEW}),
        "read": (hr.read, {"path": run / "run.h5"}),
        "set_threads": (hr.set_threads, {"number": 0}),
        "simulate": (hr.simulate, {"config": FEW, "output": None}),
        "to_coolest": (
            hr.to_coolest,
            {"path": "c.json", "lens_model_list": ["EPL"], "kwargs_lens": [KWARGS], "z_lens": 0.5, "z_source": 1.5},
        ),
        "to_lens_models": (hr.to_lens_models, {"haloes": haloes[:3]}),
        "to_slsim": (hr.to_slsim, {"path": "s.h5", "ensembles": own["ensemble"]}),
        "figures.calibration": (
            hr.figures.calibration,
            {"study": {"parameters": [{"name": "a", "rank_counts": [1, 2], "p_value": 0.5, "coverage": 0.7}]}},
        ),
        "figures.corner": (hr.figures.corner, {"fits": own["posterior"]}),
        "figures.curves": (hr.figures.curves, {"curves": curve}),
        "figures.cut": (hr.figures.cut, {"table": {}}),
        "figures.deviations": (hr.figures.deviations, {"table": {"deviation_axis_sigma": good()}}),
        "figures.exposure": (hr.figures.exposure, {"image": own["mock"].images[0]}),
        "figures.expected": (hr.figures.expected, {"study": own["ensemble"]}),
        "figures.mosaic": (hr.figures.mosaic, {"mock": own["mock"]}),
        "figures.overlay": (hr.figures.overlay, {"curves": curve, "ax": None}),
        "figures.profiles": (hr.figures.profiles, {"fit": own["fit"]}),
        "figures.reconstruction": (hr.figures.reconstruction, {"fit": own["fit"]}),
        "figures.smoothing": (hr.figures.smoothing, {"table": smoothed}),
        "figures.source_plane": (hr.figures.source_plane, {"fit": own["fit"]}),
        "figures.tidal_residuals": (hr.figures.tidal_residuals, {"study": "no folder"}),
        "figures.trace": (hr.figures.trace, {"fit": own["posterior"]}),
        **{
            f"figures.{name}": (getattr(hr.figures, name), {"run": run})
            for name in ("cylinder", "histograms", "images", "mass_function")
        },
        **{f"figures.{name}": (getattr(hr.figures, name), {"maps": run}) for name in ("tidal_maps", "flexion_maps")},
        **{
            f"figures.{name}": (getattr(hr.figures, name), {"ensemble": own["ensemble"]})
            for name in ("distributions", "joint", "settling")
        },
        **{
            f"figures.{name}": (getattr(hr.figures, name), {"table": fits})
            for name in ("recovery", "recovery_histograms", "recovery_quality")
        },
        **{
            f"figures.{name}": (getattr(hr.figures, name), {"table": validity})
            for name in hr.figures.__all__
            if name.startswith("validity_")
        },
    }


def takes_arguments(own):
    """Whether a public name is called with arguments that can be wrong: no property, no class that functions return."""
    if inspect.isclass(own.found):
        return own.name in {"Haloes", "LensModel", "LineOfSight", "LogPosterior", "Observation"}
    return not isinstance(own.found, property) and not set(inspect.signature(own.found).parameters) <= {"self", *PLAIN}


def test_every_public_callable_is_called(results):
    named = {own.name for own in public.walk() if takes_arguments(own)}
    assert named <= set(calls(results)), named - set(calls(results))


@pytest.fixture
def in_a_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    yield
    from matplotlib import pyplot

    pyplot.close("all")
    hr.set_threads(0)


def bad_calls(results, number):
    """So many calls, each with one argument of one callable that is wrong."""
    random, subjects = np.random.default_rng(5), list(calls(results).items())
    for i in range(number):
        name, (function, arguments) = subjects[i % len(subjects)]
        parameters = inspect.signature(function).parameters.values()
        named = {own.name for own in parameters if own.kind not in (own.VAR_KEYWORD, own.VAR_POSITIONAL)}
        chosen = str(random.choice(sorted((named | set(arguments)) - PLAIN)))
        wrong = BAD[random.integers(len(BAD))](random)
        yield name, chosen, wrong, lambda f=function, a=arguments, c=chosen, w=wrong: f(**{**a, c: w})


@pytest.mark.filterwarnings("ignore")
def test_over_a_thousand_calls_with_a_wrong_argument(results, in_a_folder):
    refused = 0
    for name, chosen, wrong, call in bad_calls(results, 1500):
        allowed = OF_FIGURES if name.startswith("figures.") else EXPECTED
        if name.endswith("__getitem__"):
            allowed = (*allowed, KeyError)
        try:
            call()
        except BaseException as error:
            what = f"{name}({chosen}={wrong!r}): {type(error).__name__}: {error}"
            assert isinstance(error, allowed), what
            assert str(error), what
            refused += 1
    # Some are right by chance: an empty array, a number that is allowed.
    assert refused > 1300, refused
