"""Every command of haloray on small inputs, as `kills.py` and `same_bytes.py` run it."""

import hashlib
import pathlib
import random
import shutil
import subprocess

SMALL = """[haloes]
min_point_shear = 1e-5
[image]
pixels = 12
[maps]
points = 9
"""
MODEL = """name = "small"
[line_of_sight]
model = "minimal"
[line_of_sight.parameters]
gamma1_los = { uniform = [-0.2, 0.2] }
gamma2_los = { uniform = [-0.2, 0.2] }
omega_los = 0.0
gamma1_od = 0.0
gamma2_od = 0.0
[[lens]]
profile = "SIE"
[lens.parameters]
theta_E = { uniform = [0.5, 2.5] }
e1 = { normal = [0.0, 0.1] }
e2 = { normal = [0.0, 0.1] }
[[source]]
profile = "SERSIC"
[source.parameters]
R_sersic = { log_normal = [0.3, 0.5] }
n_sersic = 2.0
center_x = { uniform = [-0.3, 0.3] }
center_y = { uniform = [-0.3, 0.3] }
"""
LENSES = """name,z_lens,z_source,theta_E_arcsec
one,0.4,1.2,1.0
two,0.6,1.8,0.8
"""
LENS = """{"z_source": 1.5, "lens_redshift_list": [0.5, 0.8], "lens_model_list": ["EPL", "NFW"], "kwargs_lens": [
 {"theta_E": 1.5, "gamma": 2.0, "e1": 0.1, "e2": 0.0}, {"Rs": 0.4, "alpha_Rs": 0.05, "center_x": 1.0, "center_y": 1.0}]}
"""
FIT = "--sampler stretch --max-draws 40 --pixel-sampling point"
# The command that is killed, and what an earlier run differed by.
COMMANDS = {
    "simulate": ("simulate small.toml -o out", "--seed 7"),
    "populate .csv": ("populate small.toml -o out.csv", "--seed 7"),
    "populate .h5": ("populate small.toml -o out.h5", "--seed 7"),
    "map": ("map small.toml -o out", "--seed 7"),
    "image": ("image small.toml -o out", "--seed 7"),
    "trace": ("trace --haloes haloes.csv --points points.csv --z-source 1.5 -o out.csv", "--order 1"),
    "fit": (f"fit in/image.fits --model model.toml {FIT} -o out", "--seed 7"),
    "lens": ("lens lens.json --points points.csv -o out.csv", "--omega-m 0.25"),
    "images": ("images lens.json --source 0.1,0.05 -o out", "--half-width-arcsec 3"),
    "relations": ("relations small.toml -o out.csv", "--preset consistent"),
    "mock": ("mock -n 6 -o out", "--seed 7"),
    "ensemble": ("ensemble small.toml -n 6 -o out", "--seed 7"),
}
for study, rest in {
    "tidal": "small.toml -n 4",
    "cut": "small.toml --cuts 1e-4,1e-5",
    "haloes": "small.toml -n 2",
    "which-shear": "small.toml --set image.pixels=48 -n 1",
    "validity": "small.toml -n 2 --views all --models tidal-minimal --starts truth --estimate laplace --no-delays",
    "expected": "small.toml --lenses lenses.csv -n 3",
    "advantage": "",
    "calibration": "-n 2",
    "catalogue": f"mine --models model.toml {FIT}",
}.items():
    COMMANDS[f"study {study}"] = (f"study {study} {rest} -o out", "--seed 7")
COMMANDS["merge"] = ("merge shards/1 shards/2 -o out", "--style dark")
COMMANDS["extract"] = ("extract cone.csv -n 4 --z-lens 0.5 --z-source 1.5 -o out", "--seed 7")
# Fits, and studies of fits.
FITS = {"fit"} | {f"study {study}" for study in ("which-shear", "validity", "advantage", "calibration", "catalogue")}
# What differs between equal runs.
TIMES = {"timings.json"}


def files(folder):
    """Bytes of what a user sees, and the hidden names."""
    seen, hidden = {}, []
    for path in sorted(folder.rglob("*")):
        relative = path.relative_to(folder)
        if not relative.parts[0].startswith(("out", ".")):
            continue
        if any(part.startswith(".") for part in relative.parts):
            hidden.append(str(relative))
        elif path.is_file() and path.name not in TIMES:
            seen[str(relative)] = hashlib.sha256(path.read_bytes()).hexdigest()
    return seen, hidden


def run(binary, folder, command, limit=None, threads=1, environment=None, emulator=()):
    """Exit code, None where `limit` seconds were over first, and stderr."""
    with subprocess.Popen(
        [*emulator, binary, *command.split(), "--quiet", "--threads", str(threads)],
        cwd=folder,
        env=environment,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
    ) as process:
        try:
            stderr = process.communicate(timeout=limit)[1]
            return process.returncode, stderr.decode()
        except subprocess.TimeoutExpired:
            process.kill()
            process.communicate()
            return None, ""


def make_inputs(binary, folder):
    folder.mkdir()
    (folder / "small.toml").write_text(SMALL)
    (folder / "model.toml").write_text(MODEL)
    (folder / "lenses.csv").write_text(LENSES)
    (folder / "lens.json").write_text(LENS)
    points = "".join(f"{i / 100},{1 - i / 80}\n" for i in range(200))
    (folder / "points.csv").write_text("theta_x_arcsec,theta_y_arcsec\n" + points)
    rng = random.Random(0)
    cone = (
        f"{rng.uniform(9.9, 10.1):.6f},{rng.uniform(-0.1, 0.1):.6f},{rng.uniform(0.05, 1.4):.4f},{10 ** rng.uniform(9, 12):.4e}\n"
        for _ in range(3000)
    )
    (folder / "cone.csv").write_text("ra_deg,dec_deg,z,m200c_msun\n" + "".join(cone))
    (folder / "shards").mkdir()
    shards = [f"ensemble small.toml -n 6 --shard {k}/2 -o shards/{k}" for k in (1, 2)]
    for command in ("populate small.toml -o haloes.csv", "image small.toml -o in", *shards):
        assert run(binary, folder, command)[0] == 0, command
    # A catalogue of one small image.
    (folder / "mine").mkdir()
    shutil.copy(folder / "in" / "image.fits", folder / "mine")
    (folder / "mine" / "truth.csv").write_text("image,gamma1_los,gamma2_los\nimage.fits,0.01,0.02\n")


def replace_section(page, name, text):
    """Puts `text` between `<!-- name -->` and `<!-- /name -->` of a page."""
    page = pathlib.Path(page)
    before, rest = page.read_text().split(f"<!-- {name} -->")
    after = rest.split(f"<!-- /{name} -->")[1]
    page.write_text(f"{before}<!-- {name} -->\n\n{text}\n\n<!-- /{name} -->{after}")
