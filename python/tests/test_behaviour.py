"""How objects behave beside their numbers: copies, threads, forks, signals, silence."""

import concurrent.futures
import multiprocessing
import pickle
import signal
import subprocess
import sys
import threading
import time

import numpy as np
import pytest
from conftest import SMALL

import haloray as hr
from haloray import _haloray


def test_elementary_functions_are_the_librarys_own():
    assert _haloray.foreign_functions() == []


def test_elementary_functions_of_others_are_not_ours():
    # Those of the C library that numpy calls for single numbers differ from libm's in some last bits.
    import ctypes
    import ctypes.util

    before = ctypes.CDLL(ctypes.util.find_library("m")).pow
    process = ctypes.CDLL(None).pow
    assert ctypes.cast(before, ctypes.c_void_p).value == ctypes.cast(process, ctypes.c_void_p).value


def test_columns_are_not_copied(haloes):
    first, second = haloes.z, haloes["z"]
    assert np.shares_memory(first, second) and not first.flags.writeable and not first.flags.owndata
    with pytest.raises(ValueError, match="read-only"):
        first[0] = 1.0
    lonely = hr.populate(SMALL, seed=4).z
    assert np.all((lonely > 0.0) & (lonely < 1.5))


def test_objects_pickle(haloes, sight):
    assert pickle.loads(pickle.dumps(haloes)) == haloes
    again = pickle.loads(pickle.dumps(sight))
    points = ([1.0, -0.5], [0.5, 0.75])
    assert np.array_equal(again.ray_shooting(*points), sight.ray_shooting(*points))
    config = hr.config("consistent", seed=7)
    assert pickle.loads(pickle.dumps(config)) == config
    lens, kwargs = hr.LensModel(["SIS"], 0.5, 1.5, cosmo=(70.0, 0.3)), [{"theta_E": 1.0}]
    again = pickle.loads(pickle.dumps(lens))
    assert again.arrival_time(1.5, 0.2, kwargs) == lens.arrival_time(1.5, 0.2, kwargs)
    error = pytest.raises(hr.InputError, hr.config, {"no": 1}).value
    again = pickle.loads(pickle.dumps(error))
    assert type(again) is hr.InputError and str(again) == str(error) and again.hint == error.hint


@pytest.mark.parametrize("preset", ["paper", "consistent"])
def test_a_configuration_is_its_text(preset):
    config = hr.config({"image": {"pixels": 31}}, preset=preset, seed=9)
    assert pickle.loads(pickle.dumps(config)) == config and "pixels = 31" in config.toml


def test_tables_come_and_go(haloes):
    astropy_table = pytest.importorskip("astropy.table")
    table = haloes.to_table()
    assert isinstance(table, astropy_table.QTable) and str(table["theta_x_arcsec"].unit) == "arcsec"
    again = hr.Haloes.from_table(table, haloes.z_source)
    assert again == haloes
    table["theta_x_arcsec"] = table["theta_x_arcsec"].to("deg")
    np.testing.assert_allclose(hr.Haloes.from_table(table, 1.5).theta_x_arcsec, haloes.theta_x_arcsec, rtol=1e-14)
    own = hr.Haloes.from_columns({**haloes.to_dict(), "id": np.arange(len(haloes)), "name": ["a"] * len(haloes)}, 1.5)
    assert own["id"][3] == 3.0 and own[own.z < 0.5].to_dict()["name"][0] == "a"
    assert len(own[:5]) == 5 and len(own[own.z < 0.5]) == np.sum(own.z < 0.5)


def test_cosmologies_of_astropy(haloes):
    cosmology = pytest.importorskip("astropy.cosmology")
    columns = haloes.to_dict()
    of_theirs = hr.Haloes.from_columns(columns, 1.5, cosmology.FlatLambdaCDM(67.4, 0.315))
    assert of_theirs == haloes
    expected = cosmology.FlatLambdaCDM(67.4, 0.315).comoving_distance(haloes.z).value
    np.testing.assert_allclose(haloes.chi_cmpc, expected, rtol=1e-8)
    with pytest.raises(hr.InputError, match="radiation"):
        hr.Haloes.from_columns(columns, 1.5, cosmology.Planck18)
    with pytest.raises(hr.InputError, match="flat"):
        hr.Haloes.from_columns(columns, 1.5, cosmology.LambdaCDM(70, 0.3, 0.6))


def test_cosmologies_of_colossus(haloes):
    cosmology = pytest.importorskip("colossus.cosmology.cosmology")
    own = {"flat": True, "H0": 67.4, "Om0": 0.315, "Ob0": 0.049, "sigma8": 0.81, "ns": 0.965}
    theirs = cosmology.setCosmology("mine", {**own, "relspecies": False})
    assert hr.Haloes.from_columns(haloes.to_dict(), 1.5, theirs) == haloes
    expected = theirs.comovingDistance(0.0, haloes.z) / theirs.h
    np.testing.assert_allclose(haloes.chi_cmpc, expected, rtol=1e-6)
    with pytest.raises(hr.InputError, match="radiation"):
        hr.Haloes.from_columns(haloes.to_dict(), 1.5, cosmology.setCosmology("mine", own))


def test_another_source(haloes):
    nearer = haloes.to_source(1.0)
    assert nearer.z_source == 1.0 and len(nearer) == np.sum(haloes.z < 1.0)
    assert haloes.to_source(1.5) is haloes
    angles = {name: haloes[name] for name in ("z", "theta_x_arcsec", "theta_y_arcsec", "r_s_arcsec", "alpha_rs_arcsec")}
    with pytest.raises(hr.InputError, match="z_source is 1.0"):
        hr.LineOfSight(hr.Haloes.from_columns(angles, 1.5), 1.0)


def test_redshifts_in_between(sight):
    x, y = np.array([0.5, -0.3]), np.array([0.2, 0.9])
    assert np.array_equal(sight.ray_shooting(x, y, z_to=1.5), sight.ray_shooting(x, y))
    assert np.allclose(sight.jacobian(0.0, 0.0, z_to=0.5), sight.effective(0.5).od.jacobian(), atol=1e-14)
    assert np.allclose(sight.jacobian(0.0, 0.0, z_from=0.5), sight.effective(0.5).ds.jacobian(), atol=1e-14)


def test_a_main_lens_on_the_way():
    none = {"z": [0.3], "theta_x_arcsec": [50.0], "theta_y_arcsec": [0.0], "m200c_msun": [1e6], "c200c": [5.0]}
    sight, kwargs = hr.LineOfSight(none, 1.5), {"theta_E": 1.4, "gamma": 2.1, "e1": 0.1, "e2": 0.0}
    through = sight.ray_shooting([1.2, -0.4], [0.3, 0.9], lens=(0.5, "EPL", kwargs))
    alone = hr.LensModel(["EPL"]).ray_shooting([1.2, -0.4], [0.3, 0.9], [kwargs])
    np.testing.assert_allclose(through, alone, atol=1e-6)


def test_threads_share_objects(sight):
    x, y = np.linspace(-2, 2, 700), np.linspace(2, -2, 700)
    expected = sight.ray_shooting(x, y)
    with concurrent.futures.ThreadPoolExecutor(4) as pool:
        for found in pool.map(lambda _: sight.ray_shooting(x, y), range(12)):
            assert np.array_equal(found, expected)
    before = hr.number_of_threads()
    hr.set_threads(1)
    assert hr.number_of_threads() == 1 and np.array_equal(sight.ray_shooting(x, y), expected)
    hr.set_threads(0)
    assert hr.number_of_threads() == before


def _in_a_child(sight, x, y, found):
    found.put(np.array(sight.ray_shooting(x, y)))


def test_a_forked_process_works_on(sight):
    x, y = np.linspace(-2, 2, 700), np.linspace(2, -2, 700)
    expected = sight.ray_shooting(x, y)
    context = multiprocessing.get_context("fork")
    found = context.Queue()
    child = context.Process(target=_in_a_child, args=(sight, x, y, found))
    child.start()
    assert np.array_equal(found.get(timeout=60), expected)
    child.join()


#: Work of many minutes, which Ctrl-C interrupts; what was made before can be used after.
LONG = """
import os, signal, sys, threading, time
import numpy as np
import haloray as hr
# Whoever runs the tests in the background ignores it, and children inherit that.
signal.signal(signal.SIGINT, signal.default_int_handler)
sight = hr.LineOfSight(hr.populate({"haloes": {"min_point_shear": 1e-6}}), accuracy_arcsec="exact")
x = np.random.default_rng(1).uniform(-3, 3, 4_000_000)
works = {
    "rays": lambda: sight.ray_shooting(x, x),
    "haloes": lambda: hr.populate({"haloes": {"mass_min_msun": 1e6}}, draw="brute-force"),
    "delays": lambda: sight.arrival_time(x, x),
    "sightlines": lambda: hr.ensemble("paper", 100_000),
}
def interrupt():
    time.sleep(1.0)
    os.kill(os.getpid(), signal.SIGINT)
    global sent
    sent = time.monotonic()
threading.Thread(target=interrupt, daemon=True).start()
try:
    works[sys.argv[1]]()
except KeyboardInterrupt:
    took = time.monotonic() - sent
    assert np.all(np.isfinite(sight.ray_shooting(1.0, 0.5)))
    print(f"interrupted after {took:.3f} s")
"""


@pytest.mark.parametrize("work", ["rays", "haloes", "delays", "sightlines"])
def test_ctrl_c_interrupts(work):
    done = subprocess.run([sys.executable, "-c", LONG, work], capture_output=True, text=True, timeout=300, check=False)
    assert done.stdout.startswith("interrupted after"), done.stderr
    assert float(done.stdout.split()[2]) < 5.0


def test_signal_handlers_of_others_are_called(sight):
    class Alarm(Exception):
        pass

    def ring(*_):
        raise Alarm

    x = np.random.default_rng(1).uniform(-3, 3, 4_000_000)
    exact = hr.LineOfSight(sight.haloes, accuracy_arcsec="exact")
    before = signal.signal(signal.SIGALRM, ring)
    try:
        signal.setitimer(signal.ITIMER_REAL, 0.2)
        with pytest.raises(Alarm):
            for _ in range(100):
                exact.ray_shooting(x, x)
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)


def test_progress_is_told(sight):
    told = []
    x = np.random.default_rng(1).uniform(-3, 3, 5_000)
    hr.LineOfSight(sight.haloes, accuracy_arcsec="exact").ray_shooting(x, x, progress=lambda *what: told.append(what))
    assert told and all(task == "trace rays" and units == 5_000 for task, _, units, _ in told)
    assert told[-1][1] == 5_000 and told == sorted(told)

    class Stop(Exception):
        pass

    def stop(*_):
        raise Stop

    with pytest.raises(Stop):
        hr.LineOfSight(sight.haloes, accuracy_arcsec="exact").ray_shooting(x, x, progress=stop)


def test_nothing_prints(capfd):
    haloes = hr.populate(SMALL, seed=1)
    hr.LineOfSight(haloes).ray_shooting([1.0], [0.5])
    hr.LensModel(["SIS"]).point_source_images(0.1, 0.0, [{"theta_E": 1.0}])
    with pytest.raises(hr.InputError):
        hr.populate({"haloes": {"radius_cmpc": -1}})
    assert capfd.readouterr() == ("", "")


def test_nothing_heavy_is_imported():
    heavy = [
        "haloray.figures",
        "arviz",
        "astropy",
        "h5py",
        "importlib.metadata",
        "matplotlib",
        "pandas",
        "scipy",
        "tqdm",
        "xarray",
    ]
    code = f"import sys; import numpy; before = set(sys.modules); import haloray; print(set({heavy}) & (set(sys.modules) - before))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "set()", done.stdout


def test_versions_are_told():
    assert hr.__version__ in hr.show_versions() and "numpy" in hr.show_versions()


def test_an_interpolated_sight_and_lenstronomys_own(sight):
    lens_model = pytest.importorskip("lenstronomy.LensModel.lens_model")
    grid = sight.to_interpol(2.0, 81)
    theirs = lens_model.LensModel(["INTERPOL"])
    x, y = np.random.default_rng(2).uniform(-1.5, 1.5, (2, 50))
    ours = sight.ray_shooting(x, y)
    error = np.hypot(*(np.array(theirs.ray_shooting(x, y, [grid.kwargs])) - ours))
    assert error.max() < grid.error_arcsec < 0.02


def test_haloes_of_lens_models_and_back(haloes):
    few = haloes[:20]
    names, redshifts, kwargs = hr.to_lens_models(few)
    again, sheets = hr.from_lens_models([*names, "CONVERGENCE"], [*redshifts, 0.4], [*kwargs, {"kappa": -0.01}], 1.5)
    assert np.array_equal(again.alpha_rs_arcsec, few.alpha_rs_arcsec) and sheets == [(0.4, -0.01)]
    lens_model = pytest.importorskip("lenstronomy.LensModel.lens_model")
    from astropy.cosmology import FlatLambdaCDM

    theirs = lens_model.LensModel(
        names, z_source=1.5, lens_redshift_list=redshifts, multi_plane=True, cosmo=FlatLambdaCDM(67.4, 0.315)
    )
    x, y = np.random.default_rng(3).uniform(-2, 2, (2, 10))
    ours = hr.LineOfSight(again, sheets="none", accuracy_arcsec="exact").ray_shooting(x, y)
    np.testing.assert_allclose(ours, theirs.ray_shooting(x, y, kwargs), rtol=0, atol=1e-11)


@pytest.mark.parametrize(("name", "mass"), [("CDM", {}), ("WDM", {"log_mc": 8.0})])
def test_a_realisation_of_pyhalo(name, mass):
    presets = pytest.importorskip("pyHalo.preset_models", exc_type=ImportError)
    lens_model = pytest.importorskip("lenstronomy.LensModel.lens_model")
    np.random.seed(3)
    draw = presets.preset_model_from_name(name)
    limits = {"log_mlow": 8.0, "log_mhigh": 10.0, "cone_opening_angle_arcsec": 6}
    realization = draw(0.5, 1.5, sigma_sub=0.02, **limits, **mass)
    haloes, sheets = hr.from_pyhalo(realization)
    names, redshifts, kwargs, _ = realization.lensing_quantities(add_mass_sheet_correction=True)
    assert len(haloes) + len(sheets) == len(names) and all(kappa < 0.0 for _, kappa in sheets)
    settings = dict(z_source=1.5, multi_plane=True, cosmo=realization.astropy_instance)
    x, y = np.random.default_rng(3).uniform(-2, 2, (2, 20))

    def both(chosen):
        lists = [names[i] for i in chosen], dict(settings, lens_redshift_list=[redshifts[i] for i in chosen])
        arguments = x, y, [kwargs[i] for i in chosen]
        return [model(lists[0], **lists[1]).ray_shooting(*arguments) for model in (hr.LensModel, lens_model.LensModel)]

    # With its sheets, and its haloes alone through the fast planes.
    np.testing.assert_allclose(*both(range(len(names))), rtol=0, atol=1e-11)
    alone, theirs = both([i for i, name in enumerate(names) if name == "TNFW"])
    fast = hr.LineOfSight(haloes, sheets="none", accuracy_arcsec="exact").ray_shooting(x, y)
    np.testing.assert_allclose(fast, alone, rtol=0, atol=1e-12)
    np.testing.assert_allclose(fast, theirs, rtol=0, atol=1e-11)


def test_threads_are_not_those_of_the_interpreter():
    # Another thread goes on while haloray works: it is never silent for half of the call.
    ticks, stop = [], threading.Event()

    def tick():
        while not stop.wait(0.001):
            ticks.append(time.perf_counter())

    other = threading.Thread(target=tick)
    other.start()
    began = time.perf_counter()
    hr.populate({"haloes": {"min_point_shear": 5e-9}})
    ended = time.perf_counter()
    stop.set()
    other.join()
    during = [began, *(t for t in ticks if began < t < ended), ended]
    assert np.diff(during).max() < 0.5 * (ended - began)


def test_names_that_lead_nowhere_are_told_apart(tmp_path):
    with pytest.raises(hr.InputError, match="config is 'consistant', but must be 'paper' or 'consistent'"):
        hr.populate("consistant")
    with pytest.raises(hr.InputError, match="^configuration: haloes.min_point_sheer: did you mean `min_point_shear`"):
        hr.populate({"seed": 1, "haloes": {"draw": "direct", "min_point_sheer": 1e-5}})
    with pytest.raises(hr.InputError, match="^configuration: haloes.min_point_shear is -1"):
        hr.populate({"haloes": {"min_point_shear": -1.0}})
    with pytest.raises(hr.MissingFileError, match="no such file or folder"):
        hr.open_run(tmp_path / "nope")
    with pytest.raises(hr.InputError, match="is a folder, but must be one of its files"):
        hr.read(tmp_path)
