"""A thousand calls with what is wrong in shape, type or value: an exception of Python each, or a right result; never an abort."""

import numpy as np
import pytest

import haloray as hr

KWARGS = {"theta_E": 1.4, "gamma": 2.1, "e1": 0.1, "e2": -0.05}
#: What calls may raise.
EXPECTED = (hr.Error, TypeError, ValueError)


def good(n=5):
    return np.linspace(0.5, 1.5, n)


BAD_ARRAYS = [
    lambda r: r.normal(size=(2, 3)),
    lambda r: r.normal(size=4),
    lambda r: r.normal(size=0),
    lambda r: np.full(5, np.nan),
    lambda r: np.where(np.arange(5) == r.integers(5), np.inf, 1.0),
    lambda r: np.array(["a", "b", "c", "d", "e"]),
    lambda r: np.array([1 + 2j] * 5),
    lambda r: np.array([None] * 5, dtype=object),
    lambda r: [[1.0, 2.0], [3.0]],
    lambda r: "text",
    lambda r: None,
    lambda r: {"a": 1.0},
    lambda r: np.zeros(5, dtype=[("a", float)]),
    lambda r: np.array(["2020-01-01"] * 5, dtype="datetime64[D]"),
    lambda r: np.ma.masked_array(good(), mask=[0, 1, 0, 0, 0]),
    lambda r: np.array([True] * 5),
    lambda r: b"bytes",
    lambda r: object(),
    lambda r: range(3),
    lambda r: -1.0e400,
]
BAD_NUMBERS = [float("nan"), float("inf"), -1.0, 0.0, "x", None, [1.0], 1j, object(), -(10**400), np.array([1.0, 2.0])]


def all_calls(haloes, sight, lens):
    """Functions of a random generator, each a bad call."""

    def bad(r):
        return BAD_ARRAYS[r.integers(len(BAD_ARRAYS))](r)

    def number(r):
        return BAD_NUMBERS[r.integers(len(BAD_NUMBERS))]

    def kwargs(r):
        own = dict(KWARGS)
        kind = r.integers(5)
        if kind == 0:
            own.pop(list(own)[r.integers(4)])
        elif kind == 1:
            own[f"unknown{r.integers(9)}"] = 1.0
        elif kind == 2:
            own[list(own)[r.integers(4)]] = number(r)
        elif kind == 3:
            return [[], [own, own], own, None, 5, [None], "text"][r.integers(7)]
        else:
            own[5] = 1.0
        return [own]

    columns = {
        "z": good() / 2,
        "theta_x_arcsec": good(),
        "theta_y_arcsec": good(),
        "m200c_msun": good(),
        "c200c": good(),
    }
    methods = ["ray_shooting", "alpha", "jacobian", "hessian", "flexion", "arrival_time"]
    of_lens = ["ray_shooting", "alpha", "hessian", "kappa", "gamma", "magnification", "flexion", "potential"]
    return [
        lambda r: getattr(sight, methods[r.integers(6)])(bad(r), good()),
        lambda r: getattr(sight, methods[r.integers(6)])(good(), bad(r)),
        lambda r: sight.ray_shooting(good(), good(), z_from=number(r), z_to=number(r)),
        lambda r: sight.ray_shooting(good(), good(), lens=(number(r), "EPL", KWARGS)),
        lambda r: sight.ray_shooting(good(), good(), lens=(0.5, ["EPL", "NO", 3][r.integers(3)], kwargs(r)[:1] or 1)),
        lambda r: sight.trace(good(), good(), number(r)),
        lambda r: sight.effective(number(r)),
        lambda r: sight.maps(number(r), number(r)),
        lambda r: sight.to_interpol(number(r), number(r)),
        lambda r: getattr(lens, of_lens[r.integers(8)])(bad(r), good(), [KWARGS]),
        lambda r: getattr(lens, of_lens[r.integers(8)])(good(), good(), kwargs(r)),
        lambda r: lens.ray_shooting(good(), good(), [KWARGS], k=[-1, 7, "a", 1.5, [9], object()][r.integers(6)]),
        lambda r: lens.ray_shooting(number(r), 0.5, [KWARGS]),
        lambda r: lens.fermat_potential(good(), good(), [KWARGS], bad(r), bad(r)),
        lambda r: lens.point_source_images(number(r), number(r), [KWARGS], number(r)),
        lambda r: lens.critical_curves([KWARGS], number(r)),
        lambda r: lens.einstein_radius([KWARGS], (number(r), number(r))),
        lambda r: hr.LensModel([["NO"], "EPL", [3], [["EPL"]], 5, None][r.integers(6)]),
        lambda r: hr.LensModel(["EPL"], number(r), number(r)).arrival_time(good(), good(), [KWARGS]),
        lambda r: hr.LensModel(["EPL"], cosmo=[number(r), (number(r), number(r)), {"H0": 70}][r.integers(3)]),
        lambda r: hr.Haloes.from_columns({**columns, list(columns)[r.integers(5)]: bad(r)}, 1.5),
        lambda r: hr.Haloes.from_columns({**columns, list(columns)[r.integers(5)]: -good()}, 1.5),
        lambda r: hr.Haloes.from_columns({name: columns[name] for name in list(columns)[r.integers(1, 5) :]}, 1.5),
        lambda r: hr.Haloes.from_columns(columns, number(r)),
        lambda r: hr.LineOfSight(columns, number(r)),
        lambda r: hr.LineOfSight(haloes, sheets=number(r), reference=number(r)),
        lambda r: hr.LineOfSight(haloes, accuracy_arcsec=number(r)),
        lambda r: hr.populate(
            {["haloes", "image", "no"][r.integers(3)]: {["radius_cmpc", "x"][r.integers(2)]: number(r)}}
        ),
        lambda r: hr.config(number(r) if r.integers(2) else bad(r)),
        lambda r: hr.config(
            seed=[-1, 2**64, 1.5, "a", None, float("nan")][r.integers(6)], draw=["no", 3][r.integers(2)]
        ),
        lambda r: haloes[bad(r)] if r.integers(2) else haloes["none"],
        lambda r: hr.Observation(
            bad(r), pixel_scale_arcsec=number(r), background_rms_e_s=number(r), exposure_s=number(r), mask=bad(r)
        ),
        lambda r: hr.fit(number(r), model=["no", {"lens": number(r)}, "a\nb", 3][r.integers(4)]),
        lambda r: hr.ensemble({"haloes": {"min_point_shear": 1e-3}}, number(r), first=number(r), lenses=bad(r)),
        lambda r: hr.ensemble("paper", 2, level=number(r), executor=bad(r)),
        lambda r: hr.mock(number(r), preset=["paper", 3][r.integers(2)], seed=number(r), images=False, executor=bad(r)),
        lambda r: sight.to_decoupled_multiplane((number(r), "EPL", kwargs(r)[:1] or 1), number(r), number(r)),
        lambda r: hr.to_coolest("none/a.json", ["EPL", "NO"][: r.integers(3)], kwargs(r), z_lens=0.5, z_source=1.5),
        lambda r: hr.read(["none.h5", "none.nc", "none.fits", "none.txt", "/"][r.integers(5)]),
    ]


def test_a_thousand_bad_calls(haloes, sight):
    random = np.random.default_rng(5)
    calls = all_calls(haloes, sight, hr.LensModel(["EPL"]))
    refused = 0
    for i in range(1000):
        try:
            calls[i % len(calls)](random)
        except EXPECTED + (OSError, KeyError, IndexError, OverflowError) as error:
            refused += 1
            assert str(error) or isinstance(error, KeyError), f"call {i % len(calls)}: an error without words"
    # Some are right by chance: an empty array, a number that is allowed.
    assert refused > 800, refused


VIEWS = {
    "read-only": lambda a: _read_only(a),
    "strided": lambda a: np.repeat(a, 2)[::2],
    "reversed": lambda a: a[::-1].copy()[::-1],
    "big-endian": lambda a: a.astype(">f8"),
    "float32": lambda a: a.astype(np.float32),
    "list": list,
    "2-d, by columns": lambda a: a.reshape(2, 2).T.copy().T,
}
HALOES = {
    "theta_x_arcsec": [1.0, 2.0, 3.0, 4.0],
    "m200c_msun": [1e9] * 4,
    "c200c": [9.0] * 4,
    "z": [0.2, 0.4, 0.6, 0.8],
}
#: What takes arrays, as functions of a line of sight and two arrays; no column or image may have another shape.
TAKERS = {
    "rays": lambda sight, x, y: sight.ray_shooting(x, y),
    "Jacobians": lambda sight, x, y: np.moveaxis(np.reshape(sight.jacobian(x, y), (4, 2, 2)), 0, 2),
    "delays": lambda sight, x, y: sight.arrival_time(x, y),
    "a lens": lambda sight, x, y: hr.LensModel(["EPL"]).hessian(x, y, [KWARGS]),
    "a potential": lambda sight, x, y: hr.LensModel(["EPL"]).potential(x, y, [KWARGS]),
    "Fermat potentials": lambda sight, x, y: hr.LensModel(["EPL"]).fermat_potential(x, y, [KWARGS], y, x),
    "columns": lambda sight, x, y: hr.Haloes.from_columns({**HALOES, "theta_y_arcsec": y}, 1.5).theta_y_arcsec,
    "an image": lambda sight, x, y: hr.Observation(
        np.broadcast_to(x, (4, 4)) if isinstance(x, list) else np.stack([x] * 4)[:, ::-1][:, ::-1],
        pixel_scale_arcsec=0.1,
        background_rms_e_s=0.1,
        exposure_s=100.0,
    ).data_e_s[0],
}


@pytest.mark.parametrize("taker", TAKERS)
@pytest.mark.parametrize("view", VIEWS)
def test_unusual_arrays_give_the_right_result(sight, view, taker):
    if view.startswith("2-d") and taker in ("columns", "an image"):
        pytest.skip("columns and images have one shape")
    # Numbers that float32 holds exactly.
    x, y = np.array([1.0, -0.5, 2.0, 0.25]), np.array([0.5, 0.75, -1.0, 2.0])
    expected = TAKERS[taker](sight, x, y)
    given = VIEWS[view](x), VIEWS[view](y)
    before = [np.array(own) for own in given]
    found = TAKERS[taker](sight, *given)
    assert np.array_equal(np.reshape(found, np.shape(expected)), expected)
    assert all(np.array_equal(own, old) for own, old in zip(given, before)), "what is given stays as it is"


def test_whole_numbers_are_numbers(sight):
    assert np.array_equal(
        sight.ray_shooting(np.array([1, 2]), np.array([0, -1])), sight.ray_shooting([1.0, 2.0], [0.0, -1.0])
    )


def test_no_rays_are_no_rays(sight):
    nothing = sight.trace([], [], 2)
    assert nothing.beta_x_arcsec.shape == (0,) and nothing.second_per_arcsec.shape == (0, 2, 2, 2)
    assert sight.arrival_time([], []).shape == (0,)
    exact = hr.LineOfSight(sight.haloes, accuracy_arcsec="exact")
    assert exact.jacobian(np.zeros((0, 3)), np.zeros((0, 3))).shape == (0, 3, 2, 2)
    assert hr.LensModel(["EPL"], 0.5, 1.5).arrival_time([], [], [KWARGS]).shape == (0,)


def _read_only(a):
    a = a.copy()
    a.flags.writeable = False
    return a


def test_errors_name_argument_and_domain(haloes, sight):
    with pytest.raises(hr.InputError, match=r"y_arcsec\[1\] is NaN, but must be a finite number"):
        sight.ray_shooting([1.0, 2.0], [1.0, np.nan])
    with pytest.raises(hr.InputError, match=r"theta_E of EPL .*is -1, but must be"):
        hr.LensModel(["EPL"]).ray_shooting(1.0, 0.0, [{**KWARGS, "theta_E": -1.0}])
    with pytest.raises(hr.InputError, match="haloes.radius_cmpc is -1, but must be positive") as caught:
        hr.populate({"haloes": {"radius_cmpc": -1}})
    assert "haloray schema" in caught.value.hint
    with pytest.raises(FileNotFoundError) as caught:
        hr.populate("none.toml")
    assert caught.value.errno == 2 and isinstance(caught.value, hr.Error)
    with pytest.raises(hr.InputError, match="z of halo 1 is -2, but must be"):
        hr.Haloes.from_columns(
            {"z": [-2.0], "theta_x_arcsec": [0], "theta_y_arcsec": [0], "m200c_msun": [1], "c200c": [5]}, 1.5
        )
