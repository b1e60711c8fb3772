"""Ensembles and mock catalogues: the rows of the command, whatever computes them."""

import concurrent.futures
import csv
import pickle

import numpy as np
import pytest
from conftest import SMALL

import haloray as hr

#: Sightlines that cost a few milliseconds.
FEW = {"haloes": {"min_point_shear": 3e-5}, "image": {"pixels": 16}, "maps": {"points": 9}}


def same(a, b):
    assert list(a.columns) == list(b.columns) and a.failures == b.failures
    for one, other in (
        (a.columns, b.columns),
        (a.tidal_haloes, b.tidal_haloes),
        (a.maps, b.maps),
        (a.images, b.images),
    ):
        assert list(one) == list(other)
        for name in one:
            assert np.array_equal(one[name], other[name], equal_nan=True), name


@pytest.mark.parametrize("level", ["scalars", "maps", "images"])
def test_executors_and_chunks_leave_every_bit(level):
    whole = hr.ensemble(FEW, 7, seed=5, level=level)
    with concurrent.futures.ThreadPoolExecutor(3) as executor:
        same(whole, hr.ensemble(FEW, 7, seed=5, level=level, executor=executor, chunk=2))
    part = hr.ensemble(FEW, 3, seed=5, level=level, first=4)
    assert list(part.sightline) == [4, 5, 6]
    assert np.array_equal(part["gamma1_los"], whole["gamma1_los"][4:])
    if level != "scalars":
        name = next(iter(part.maps or part.images))
        assert part[name].shape[0] == 3 and np.array_equal(part[name], whole[name][4:])
    same(whole, pickle.loads(pickle.dumps(whole)))


def test_processes_leave_every_bit():
    import multiprocessing

    context = multiprocessing.get_context("spawn")
    options = {"initializer": hr.set_threads, "initargs": (1,)}
    with concurrent.futures.ProcessPoolExecutor(2, mp_context=context, **options) as executor:
        same(hr.ensemble(SMALL, 5, seed=2), hr.ensemble(SMALL, 5, seed=2, executor=executor, chunk=2))


def test_the_file_of_the_command(command, tmp_path):
    lenses = [{"name": "a", "z_lens": 0.3, "z_source": 0.9}, {"name": "b", "z_lens": 0.6, "z_source": 2.0}]
    (tmp_path / "lenses.csv").write_text("name,z_lens,z_source\na,0.3,0.9\nb,0.6,2.0\n")
    (tmp_path / "few.toml").write_text("[haloes]\nmin_point_shear = 3e-5\n[maps]\npoints = 9\n")
    few = str(tmp_path / "few.toml")
    folder = command(
        "ensemble",
        few,
        "-n",
        "2",
        "--seed",
        "4",
        "--level",
        "maps",
        "--lenses",
        str(tmp_path / "lenses.csv"),
        "--smoothing",
        "30,7.5",
        "-o",
        "ens",
    )
    found = hr.ensemble(few, 2, seed=4, level="maps", lenses=lenses, smoothing_arcsec=[30, 7.5, 30])
    assert found["gamma1_los_disc_7.5"].shape == (4,)
    found.write(tmp_path / "own")
    ours, theirs = tmp_path / "own", folder / "ens"
    for name in ("sightlines.h5", "summary.json", "config.toml", "figures/distributions.svg"):
        assert (ours / name).read_bytes() == (theirs / name).read_bytes(), name
    assert list(found["lens"]) == [0, 1, 0, 1] and list(found["z_source"]) == [0.9, 2.0, 0.9, 2.0]


def test_what_fails_is_told():
    with pytest.raises(hr.InputError, match="model is haloes, but must be one with gamma1_los"):
        hr.ensemble(FEW, 2, level="fits", model="haloes")
    with pytest.raises(hr.InputError, match="level is 'none'"):
        hr.ensemble(FEW, 2, level="none")
    with pytest.raises(hr.InputError, match="column z_source of lenses is missing"):
        hr.ensemble(FEW, 2, lenses={"z_lens": [0.5]})
    with pytest.raises(hr.InputError, match="lens 1 has z_lens = 0.5 and z_source = 0.4"):
        hr.ensemble(FEW, 2, lenses={"z_lens": [0.5], "z_source": [0.4]})
    with pytest.raises(hr.InputError, match="executor is 3"):
        hr.ensemble(FEW, 2, executor=3)
    with pytest.raises(hr.InputError, match="n is 0"):
        hr.ensemble(FEW, 0)
    with pytest.raises(KeyError):
        hr.ensemble(FEW, 1)["none"]


def test_an_ensemble_as_data_set():
    xarray = pytest.importorskip("xarray")
    found = hr.ensemble(FEW, 4, seed=5, level="maps")
    scalars, maps = found.to_xarray(), found.to_xarray("maps")
    assert isinstance(scalars, xarray.Dataset) and scalars.sizes == {"sightline": 4}
    assert scalars.gamma1_los.attrs["long_name"] and scalars.F1_os_per_arcsec.attrs["units"] == "arcsec^-1"
    assert maps.kappa.shape == (4, 9, 9) and maps.x.values[[0, -1]] == pytest.approx([-2.5, 2.5])
    np.testing.assert_allclose(maps.kappa.sel(x=0, y=0, method="nearest"), found["kappa_os"], rtol=1e-6)


def test_mocks_are_those_of_the_command(command):
    folder = command("mock", "-n", "3", "--seed", "6", "-o", "mock")
    found = hr.mock(3, seed=6)
    with open(folder / "mock" / "catalogue.csv", newline="") as file:
        rows = list(csv.DictReader(line for line in file if not line.startswith("#")))
    for name, values in found.columns.items():
        assert [float(row[name]) for row in rows] == list(values), name
    assert [float(row["quality"]) for row in rows] == [image.quality for image in found.images]
    for number, image in enumerate(found.images):
        written = hr.read(folder / "mock" / "images" / f"{number:02}.fits")
        assert np.array_equal(written.data_e_s, image.noisy_e_s)
        assert np.array_equal(image.observation().data_e_s, image.noisy_e_s)
    assert found.truths["gamma1_los"] == pytest.approx(found["gamma1_los"])


def test_a_source_without_perturbers_is_the_same_source():
    with_all, without = (hr.mock(3, seed=6, perturbers=own) for own in (True, False))
    assert (with_all["perturbers"] > 0).all() and (without["perturbers"] == 0).all()
    for name in ("z_lens", "source_magnitude", "source_x_arcsec", "gamma1_los"):
        assert (with_all[name] == without[name]).all()
    assert (with_all.images[0].source_e_s - without.images[0].source_e_s).max() > 0.0


def test_mocks_by_an_executor():
    whole = hr.mock(5, seed=3, images=False, preset="text")
    with concurrent.futures.ThreadPoolExecutor(2) as executor:
        parts = hr.mock(5, seed=3, images=False, preset="text", executor=executor, chunk=2)
    for name in whole.columns:
        assert np.array_equal(whole[name], parts[name])
    later = hr.mock(2, seed=3, images=False, preset="text", first=3)
    assert np.array_equal(later["halo_m200c_msun"], whole["halo_m200c_msun"][3:]) and not later.images
    with pytest.raises(hr.InputError, match='preset is none, but must be "paper" or "text"'):
        hr.mock(1, preset="none")
    table = pytest.importorskip("astropy.table") and whole.to_table()
    assert str(table["halo_m200c_msun"].unit) == "solMass" and len(table) == 5
