"""The package gives what the command gives, to the bit."""

import csv

import numpy as np
import pytest
from conftest import SMALL

import haloray as hr


def read(path):
    with open(path, newline="") as file:
        rows = list(csv.reader(line for line in file if not line.startswith("#")))
    return {name: np.array([float(row[i]) for row in rows[1:]]) for i, name in enumerate(rows[0])}


@pytest.mark.parametrize("preset", ["paper", "consistent"])
def test_haloes(command, tmp_path, preset):
    folder = command("populate", "small.toml", "--preset", preset, "--seed", "3", "-o", "haloes.csv")
    haloes = hr.populate(SMALL, preset=preset, seed=3)
    theirs = read(folder / "haloes.csv")
    assert len(haloes) > 100
    for name, values in theirs.items():
        assert np.array_equal(haloes[name], values), name
    haloes.write(tmp_path / "haloes.csv")
    assert (tmp_path / "haloes.csv").read_bytes() == (folder / "haloes.csv").read_bytes()


def test_another_sightline(command):
    folder = command("populate", "small.toml", "--sightline", "2", "-o", "second.csv")
    assert np.array_equal(hr.populate(SMALL, sightline=2).z, read(folder / "second.csv")["z"])


@pytest.mark.parametrize("accuracy", ["exact", 1e-7])
def test_rays(command, haloes, accuracy):
    axis = np.linspace(-2.0, 2.0, 40)
    x, y = (grid.reshape(-1) for grid in np.meshgrid(axis, axis))
    folder = command("populate", "small.toml", "--seed", "3", "-o", "haloes.h5")
    rows = "\n".join(f"{a!r},{b!r}" for a, b in zip(x.tolist(), y.tolist()))
    (folder / "points.csv").write_text(f"theta_x_arcsec,theta_y_arcsec\n{rows}\n")
    options = ["--haloes", "haloes.h5", "--points", "points.csv", "--z-source", "1.5", "--order", "2", "--delay"]
    command("trace", *options, "--accuracy", str(accuracy), "-o", "rays.csv")
    theirs = read(folder / "rays.csv")
    sight = hr.LineOfSight(haloes, accuracy_arcsec=accuracy)
    rays = sight.trace(x, y, 2)
    assert np.array_equal(rays.beta_x_arcsec, theirs["beta_x_arcsec"])
    assert np.array_equal(rays.beta_y_arcsec, theirs["beta_y_arcsec"])
    for i, a in enumerate("xy"):
        for j, b in enumerate("xy"):
            assert np.array_equal(rays.jacobian[:, i, j], theirs[f"a_{a}{b}"])
            for k, c in enumerate("xy"):
                name = f"b_{a}" + "".join(sorted(b + c))
                assert np.array_equal(rays.second_per_arcsec[:, i, j, k], theirs[name]), name
    assert np.array_equal(sight.arrival_time(x, y), theirs["delay_days"])


def test_image(command, tmp_path):
    folder = command("image", "small.toml", "--seed", "3", "-o", "image.fits")
    image = hr.image(SMALL, seed=3)
    image.write(tmp_path / "image.fits")
    assert (tmp_path / "image.fits").read_bytes() == (folder / "image.fits").read_bytes()
    assert image.noisy_e_s.shape == image.noise_free_e_s.shape
    astropy = pytest.importorskip("astropy")
    hdus = image.to_hdus()
    assert astropy and np.array_equal(hdus[0].data, image.noisy_e_s) and "EXPTIME" in hdus[0].header


def test_a_lens_model(command):
    folder = command("populate", "small.toml", "-o", "unused.csv")
    model = '{"z_lens": 0.5, "z_source": 1.5, "lens_model_list": ["EPL", "SHEAR"], "kwargs_lens": [%s, %s]}' % (
        '{"theta_E": 1.4, "gamma": 2.2, "e1": 0.1, "e2": -0.05}',
        '{"gamma1": 0.03, "gamma2": -0.02}',
    )
    (folder / "model.json").write_text(model)
    (folder / "two.csv").write_text("theta_x_arcsec,theta_y_arcsec\n1.2,0.3\n-0.4,0.9\n")
    command("lens", "model.json", "--points", "two.csv", "-o", "lensed.csv")
    theirs = read(folder / "lensed.csv")
    lens = hr.LensModel(["EPL", "SHEAR"], z_lens=0.5, z_source=1.5)
    kwargs = [{"theta_E": 1.4, "gamma": 2.2, "e1": 0.1, "e2": -0.05}, {"gamma1": 0.03, "gamma2": -0.02}]
    points = ([1.2, -0.4], [0.3, 0.9], kwargs)
    beta = lens.ray_shooting(*points)
    assert np.array_equal(beta, [theirs["beta_x_arcsec"], theirs["beta_y_arcsec"]])
    assert np.array_equal(lens.hessian(*points), [theirs[f"f_{ij}"] for ij in ("xx", "xy", "yx", "yy")])
    assert np.array_equal(lens.fermat_potential(*points), theirs["fermat_arcsec2"])
    assert np.array_equal(lens.arrival_time(*points), theirs["delay_days"])
    assert lens.ray_shooting(1.2, 0.3, kwargs) == (beta[0][0], beta[1][0])


def test_a_simulation_and_what_is_read_of_it(tmp_path):
    config = {"haloes": {"min_point_shear": 1e-4}, "image": {"pixels": 30}, "maps": {"points": 11}}
    run = hr.simulate(config, seed=2, output=tmp_path / "run")
    again = hr.read(tmp_path / "run" / "run.h5")
    assert again.config == run.config
    assert again.haloes()[: len(run.haloes)] == hr.Haloes.read(tmp_path / "run" / "run.h5", 1.5)
    assert np.array_equal(again.haloes().z, run.haloes.z)
    assert run.summary["number_kept"] == len(run.haloes)
    assert run.all_haloes.noisy_e_s.shape == (30, 30)
    observation = hr.read(tmp_path / "run" / "image_all_haloes.fits")
    assert np.array_equal(observation.data_e_s, run.all_haloes.noisy_e_s)
    with pytest.raises(hr.InputError, match=r"Haloes\.read"):
        hr.read(tmp_path / "run" / "summary.json")
