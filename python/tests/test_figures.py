"""Figures: each is drawn from what is saved, shows what it should, and goes into axes of the user's own."""

import csv
import itertools

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


def test_a_few_far_sightlines_do_not_press_all_others_into_one_bin():
    xarray = pytest.importorskip("xarray")
    delta = np.append(np.geomspace(0.1, 1.0, 299), 1e6)
    panel = hr.figures.distributions(xarray.Dataset({"delta_tot": ("sightline", delta)})).axes[2]
    shown = panel.patches[0].get_data()
    assert np.array_equal(shown.values, np.histogram(delta, shown.edges)[0]) and sum(shown.values) == 299
    assert shown.edges[-1] < 2.0 and panel.get_title(loc="right") == "up to 1 outside"


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


def test_profile_likelihoods_stand_beside_the_posterior():
    from haloray._drawing.density import curve

    draws = {"lens.theta_E": np.random.default_rng(6).normal(1.5, 0.1, (2, 400)), "gamma1_los": np.zeros((2, 400))}
    values, lower = [1.2, 1.4, 1.5, 1.7], [-4.5, -0.5, 0.0, -2.0]
    theta_e = {"name": "lens.theta_E", "unit": "arcsec", "best_fit": 1.5, "values": values}
    profiles = [
        {**theta_e, "delta_log_likelihood": lower},
        {**theta_e, "name": "gamma1_los", "unit": "", "delta_log_likelihood": lower},
    ]
    zero = np.zeros((1, 1))
    fit = hr.Fit({}, draws, {}, {"profiles": profiles}, zero, zero, "", zero, 0.1, {})
    figure = hr.figures.profiles(fit, truths={"lens.theta_E": 1.48})
    assert [ax.get_xlabel() for ax in figure.axes] == [
        "lens θ$_{\\mathrm{E}}$ [arcsec]",
        "γ$_{\\mathrm{1}}^{\\mathrm{LOS}}$",
    ]
    low, high, likelihood, posterior, truth = figure.axes[0].lines
    assert [low.get_ydata()[0], high.get_ydata()[0]] == pytest.approx([np.exp(-0.5), np.exp(-2.0)])
    x, y = likelihood.get_data()
    assert x[::12] == pytest.approx(values) and y[::12] == pytest.approx(np.exp(lower))
    # √(−2Δln L) is 3 and 1 to the left of the best fit, and 2 half-way.
    assert (x[6], y[6]) == pytest.approx((1.3, np.exp(-2.0)))
    assert np.array_equal(posterior.get_data(), curve(draws["lens.theta_E"]))
    assert truth.get_xdata()[0] == 1.48
    assert not len(figure.axes[1].lines[3].get_xdata()), "draws that are all one have no density"
    with pytest.raises(hr.InputError, match="profile"):
        hr.figures.profiles(hr.Fit({}, draws, {}, {}, zero, zero, "", zero, 0.1, {}))
    with pytest.raises(hr.InputError, match=r"posterior\.nc"):
        hr.figures.profiles(hr.Posterior(draws, {}))


def test_expected_shears_are_those_of_each_lens(tmp_path):
    lenses = [{"z_lens": 0.3, "z_source": 1.0, "name": "near"}, {"z_lens": 0.5, "z_source": 2.0, "name": "far"}]
    own = hr.ensemble(SMALL, 24, seed=3, lenses=lenses, smoothing_arcsec=[10.0])
    own.write(tmp_path / "ensemble")
    for study in (own, tmp_path / "ensemble"):
        figure = hr.figures.expected(study)
        near, far = figure.axes[:2]
        assert near.get_xlabel().endswith(", near (0.3, 1)") and far.get_xlabel().endswith(", far (0.5, 2)")
        assert [words.get_text() for words in far.get_legend().get_texts()] == ["axis", "ring", "disc 10″"]
        for line, rest in zip(far.lines, ("los", "los_ring", "los_disc_10")):
            sizes = np.sort(np.hypot(own[f"gamma1_{rest}"], own[f"gamma2_{rest}"])[own["lens"] == 1.0])
            x, y = line.get_data()
            assert np.unique(x) == pytest.approx(sizes) and x[np.searchsorted(y, 0.5)] == sizes[12]
    (ax,) = [ax for ax in hr.figures.expected(hr.ensemble(SMALL, 5, seed=3)).axes if ax.lines]
    assert ax.get_xlabel() == "|γ$^{\\mathrm{LOS}}$|" and len(ax.lines) == 2


def test_smoothing_falls_with_the_radius_of_each_lens(tmp_path):
    rows = [
        "name,averaged_over,radius_arcsec,sigma_gamma_los,sigma_gamma_los_error",
        *("1,axis,0,0.04,0.01", "1,ring,1.5,0.03,0.004", "1,disc 10,10,0.02,0.002"),
        *("2,axis,0,0.02,0.01", "2,ring,0.8,0.01,0.001", "2,disc 10,10,0.005,0.0005"),
    ]
    (tmp_path / "expected.csv").write_text("\n".join(rows))
    ax = hr.figures.smoothing(tmp_path)
    first, second = ax.lines
    assert first.get_xydata().tolist() == [[1.5, 0.03], [10.0, 0.02]]
    assert second.get_xydata().tolist() == [[0.8, 0.01], [10.0, 0.005]]
    assert ax.collections[1].get_paths()[0].get_extents().extents == pytest.approx([0.8, 0.0045, 10.0, 0.011])
    assert [words.get_text() for words in ax.get_legend().get_texts()] == ["1", "2"]
    assert ax.get_ylim() == pytest.approx((0.0, 1.5 * 0.034))


SHEARS = [
    f"gamma{i}_los_{name}" for name in ("axis", "ring", "light", "best_tidal", "best_flexion", "fit") for i in (1, 2)
]


@pytest.fixture
def validity():
    """A table of the study of validity: two cases, views and starts, and one fit that failed."""
    rng = np.random.default_rng(8)
    kinds = itertools.product(
        ("base", "key=1"), ("all", "0.1"), ("haloes", "tidal"), ("first", "second"), ("blind", "truth"), range(5)
    )
    names = ("case", "haloes", "mock", "model", "start", "sightline")
    table = {name: np.array(values) for name, values in zip(names, zip(*kinds))}
    n = len(table["case"])
    table |= {name: rng.normal(0.0, 0.02, n) for name in SHEARS}
    table |= {"covariance_11": np.full(n, 1e-4), "covariance_12": np.full(n, 5e-5), "covariance_22": np.full(n, 4e-4)}
    table |= {"chi2": rng.uniform(300, 400, n), "p_value": rng.choice([1e-5, 0.4], n)}
    table |= {"chi2_excess": rng.choice([-3.0, 10.0, 60.0], n), "log_evidence": rng.normal(2000.0, 8.0, n)}
    table |= {name: rng.uniform(0.01, 1.0, n) for name in ("delta_tot", "delta_tot_ring", "residual_best_tidal_arcsec")}
    table |= {f"h0_ratio_{name}": rng.normal(1.0, 0.05, n) for name in ("axis", "ring", "fit")}
    table |= {"halo_m200c_msun": 10.0 ** rng.uniform(6, 12, n), "halo_z": rng.uniform(0.0, 1.5, n)}
    for name in (*SHEARS[-2:], "chi2", "p_value", "chi2_excess", "log_evidence", "h0_ratio_fit"):
        table[name][4] = np.nan
    return table


def fits_of(table, view, mock="haloes", model="first"):
    """The fits that are drawn, one by one."""
    wanted = {"case": "base", "haloes": view, "mock": mock, "model": model, "start": "blind"}
    rows = [{name: values[i] for name, values in table.items()} for i in range(len(table["case"]))]
    return [row for row in rows if all(row[name] == own for name, own in wanted.items()) and row["chi2"] > 0.0]


def test_fitted_shears_stand_against_those_defined(validity):
    figure = hr.figures.validity_fitted_shears(validity)
    assert len(figure.axes) == 6 and len(hr.figures.validity_fitted_shears(validity, threshold=0.3).axes) == 3
    assert len(fits_of(validity, "all")) == 4, "one failed"
    for ax, (view, name) in zip(figure.axes, itertools.product(("all", "0.1"), ("axis", "ring", "best_tidal"))):
        fits = fits_of(validity, view)
        for drawn, is_good in zip(ax.containers, (False, True)):
            wanted = [
                (fit[f"gamma{i}_los_{name}"], fit[f"gamma{i}_los_fit"])
                for i in (1, 2)
                for fit in fits
                if (fit["p_value"] > 1e-3) == is_good
            ]
            points, _, (bars,) = drawn.lines
            assert points.get_xydata().tolist() == [list(point) for point in wanted]
            widths = [high - low for (_, low), (_, high) in bars.get_segments()]
            assert widths == pytest.approx([0.02] * (len(wanted) // 2) + [0.04] * (len(wanted) // 2))
        largest = max(abs(fit[f"gamma{i}_los_{of}"]) for fit in fits for i in (1, 2) for of in (name, "fit"))
        assert ax.get_xlim() == ax.get_ylim() == pytest.approx((-1.3 * largest, 1.3 * largest))
        assert ax.get_xlabel().endswith(name.replace("_", " "))
    assert figure.axes[3].get_title(loc="left") == "seen: Δ$_{\\mathrm{h}}$ < 0.1"


def test_coverage_counts_the_fits_within_their_errors(validity):
    inverse = np.linalg.inv([[1e-4, 5e-5], [5e-5, 4e-4]])

    def sigmas(fits, name):
        off = [np.array([fit[f"gamma{i}_los_fit"] - fit[f"gamma{i}_los_{name}"] for i in (1, 2)]) for fit in fits]
        return sorted(np.sqrt(0.5 * d @ inverse @ d) for d in off)

    for ax, view in zip(hr.figures.validity_coverage(validity).axes, ("all", "0.1")):
        names = [words.get_text() for words in ax.get_legend().get_texts()]
        assert names == ["axis", "ring", "light", "best tidal", "best flexion", "tidal twins", "right errors"]
        for line, name in zip(ax.lines, names[:5]):
            wanted = sigmas(fits_of(validity, view), name.replace(" ", "_"))
            assert line.get_xdata() == pytest.approx(np.repeat(wanted, 2)) and line.get_ydata()[-1] == 1.0
            assert line.get_ydata()[1] == 1.0 / len(wanted)
        twins = sigmas(fits_of(validity, view, "tidal"), "best_tidal")
        assert ax.lines[5].get_xdata()[::2] == pytest.approx(twins)
        right = dict(zip(*ax.lines[6].get_data()))
        assert right[1.0] == pytest.approx(1.0 - np.exp(-1.0))


def test_the_excess_of_chi2_is_that_of_the_table_in_a_folder_too(validity, tmp_path):
    with open(tmp_path / "validity.csv", "w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(validity)
        writer.writerows(
            ["" if value == "nan" else value for value in map(str, row)] for row in zip(*validity.values())
        )
    for table in (validity, tmp_path, tmp_path / "validity.csv"):
        figure = hr.figures.validity_excess(table)
        for ax, name in zip(figure.axes, ("delta_tot", "delta_tot_ring", "residual_best_tidal_arcsec")):
            for line, view in zip(ax.lines, ("all", "0.1")):
                wanted = [[fit[name], max(fit["chi2_excess"], 0.1)] for fit in fits_of(validity, view)]
                assert line.get_xydata().tolist() == wanted
            assert ax.lines[2].get_ydata()[0] == 25.0 and ax.get_xscale() == ax.get_yscale() == "log"


def test_the_share_that_fails_is_counted_by_view(validity):
    ax = hr.figures.validity_failing(validity)
    odds = {}
    for view in ("all", "0.1"):
        first = {fit["sightline"]: fit["log_evidence"] for fit in fits_of(validity, view)}
        second = fits_of(validity, view, model="second")
        odds[view] = [fit["log_evidence"] - first.get(fit["sightline"], np.nan) > 5.0 for fit in second]
    wanted = {
        "first: p < 0.001": lambda view: [fit["p_value"] < 1e-3 for fit in fits_of(validity, view)],
        "first: χ² above the twin's by 25": lambda view: [fit["chi2_excess"] > 25 for fit in fits_of(validity, view)],
        "second: p < 0.001": lambda view: [fit["p_value"] < 1e-3 for fit in fits_of(validity, view, model="second")],
        "second preferred by evidence": odds.get,
    }
    assert [words.get_text() for words in ax.get_legend().get_texts()] == list(wanted)
    for i, (drawn, fails) in enumerate(zip(ax.containers, wanted.values())):
        points, _, (bars,) = drawn.lines
        shift = 1.0 + 0.02 * i
        assert points.get_xdata() == pytest.approx([0.1 * shift, 0.4 * shift])
        for view, share, ((_, low), (_, high)) in zip(("0.1", "all"), points.get_ydata(), bars.get_segments()):
            hits, n = sum(fails(view)), len(fails(view))
            p = (hits + 1) / (n + 2)
            assert share == pytest.approx(100.0 * hits / n)
            assert high - low == pytest.approx(200.0 * np.sqrt(p * (1 - p) / n))
    assert [label.get_text() for label in ax.get_xticklabels()] == ["0.4", "0.1"]


def test_h0_of_delays_is_counted_within_reach(validity):
    figure = hr.figures.validity_delays(validity)
    for ax, view in zip(figure.axes, ("all", "0.1")):
        sets = [[fit[f"h0_ratio_{name}"] for fit in fits_of(validity, view)] for name in ("axis", "ring", "fit")]
        sizes = np.sort(np.abs(np.concatenate(sets) - 1.0))
        reach = sizes[len(sizes) * 9 // 10]
        for outline, values in zip(ax.patches[1::2], sets):
            counts, edges, _ = outline.get_data()
            assert (edges[0], edges[-1], len(counts)) == pytest.approx((1.0 - reach, 1.0 + reach, 40))
            for value in np.array(values)[np.abs(np.array(values) - 1.0) < 0.999 * reach]:
                assert counts[np.searchsorted(edges, value) - 1] > 0
            assert counts.sum() == pytest.approx(np.sum(np.abs(np.array(values) - 1.0) < reach), abs=1)
    without = {name: np.full(len(own), np.nan) if name.startswith("h0") else own for name, own in validity.items()}
    with pytest.raises(hr.InputError, match="without delays"):
        hr.figures.validity_delays(without)


def test_varying_haloes_are_split_by_what_is_noticed(validity):
    ax = hr.figures.validity_haloes(validity)
    fits = fits_of(validity, "all")
    for line, is_noticed in zip(ax.lines, (False, True)):
        wanted = [[fit["halo_z"], fit["halo_m200c_msun"]] for fit in fits if (fit["chi2_excess"] > 25.0) == is_noticed]
        assert line.get_xydata().tolist() == wanted
    masses = [fit["halo_m200c_msun"] for fit in fits]
    assert ax.get_ylim() == pytest.approx((0.7 * min(masses), 8.0 * max(masses)))


def test_the_folders_of_the_command(command):
    pixels = ("image.pixels=20", "instrument.pixel_scale_arcsec=0.2", "instrument.psf_fwhm_arcsec=0.2")
    small = ("small.toml", "--no-figures", *(word for key in (*pixels, "maps.points=9") for word in ("--set", key)))
    options = ("--views", "all,0.1", "--models", "tidal-minimal", "--starts", "truth", "--estimate", "laplace")
    folder = command("study", "validity", *small, *options, "--no-delays", "-n", "2", "-o", "validity")
    for ax in hr.figures.validity_coverage(folder / "validity").axes[:2]:
        assert [len(line.get_xdata()) for line in ax.lines[:6]] == [4] * 6
    with pytest.raises(hr.InputError, match="without delays"):
        hr.figures.validity_delays(folder / "validity")
    (folder / "lenses.csv").write_text("z_lens,z_source\n0.3,1.2\n")
    command("study", "expected", *small, "--lenses", "lenses.csv", "-n", "9", "-o", "expected")
    with open(folder / "expected" / "expected.csv", newline="") as file:
        rows = list(csv.DictReader(line for line in file if not line.startswith("#")))
    lines = hr.figures.expected(folder / "expected").axes[0].lines
    medians = [line.get_xdata()[200] for line in lines]
    assert medians == pytest.approx([float(row["abs_gamma_los_50_per_cent"]) for row in rows]) and len(rows) == 5
    (smoothed,) = hr.figures.smoothing(folder / "expected").lines
    assert smoothed.get_ydata().tolist() == [float(row["sigma_gamma_los"]) for row in rows[1:]]


def test_what_the_tidal_model_leaves_is_drawn_from_the_folder_of_its_study(command):
    folder = command("study", "tidal", "small.toml", "--set", "image.pixels=30", "-n", "3", "-o", "tidal") / "tidal"
    figure = hr.figures.tidal_residuals(folder)
    maps = [ax for ax in figure.axes if ax.images]
    assert len(maps) == 4
    run = hr.read(folder / "residual_maps.h5")
    for ax, values in zip(maps, (run.groups["rays"]["tidal_arcsec"], run.groups["rays"]["flexion_arcsec"])):
        assert np.array_equal(ax.images[0].get_array().filled(np.nan), values, equal_nan=True)
    with open(folder / "residuals.csv", encoding="utf-8") as file:
        rows = list(csv.DictReader(line for line in file if not line.startswith("#")))
    (points,) = (line for ax in figure.axes for line in ax.lines if ax.get_xlabel().startswith("rms") and len(line.get_xdata()) == 3)
    assert points.get_ydata().tolist() == [float(row["flexion_rms_arcsec"]) for row in rows]
    tidal = run.groups["rays"]["tidal_arcsec"]
    assert np.sqrt(np.nanmean(tidal**2)) == pytest.approx(float(rows[0]["tidal_rms_arcsec"]), rel=1e-12)


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
