# Named commands; `cargo install just` provides `just`, plain shell lines do as well.

# list the commands
default:
    @just --list

# what Debian needs besides Rust
setup:
    sudo apt-get install -y gcc libc6-dev libhdf5-dev python3-venv

# the main job: the paper's section 4 into ./run
run:
    cargo run --release -- simulate -o run

# both test suites
test:
    bash tests/run

# the Python package, installed into ./.venv and tested
python:
    python3 -m venv .venv
    .venv/bin/pip install --quiet './python[test,all]'
    HALORAY_COMMAND=.venv/bin/haloray .venv/bin/python -m pytest -q python/tests

# the Python package beside lenstronomy and the library, in one run
bench-python: python
    .venv/bin/python python/benchmarks/speed.py --command .venv/bin/haloray

# types of the Python package, of the examples and of what pages and notebooks show: mypy --strict and pyright's strict mode
types:
    python3 -m venv target/types_venv
    target/types_venv/bin/pip install --quiet mypy==2.4.1 pyright==1.1.414 'numpy>=2.4' 'matplotlib>=3.11' 'xarray>=2026.9' 'astropy>=8' pandas-stubs
    target/types_venv/bin/python python/check_types.py target/types

# the stub of the Python package's native half against the built one
stub: python
    .venv/bin/pip install --quiet mypy==2.4.1
    printf 'haloray._haloray.__all__\n' > target/stub_allowed
    .venv/bin/python -m mypy.stubtest haloray._haloray --concise --allowlist target/stub_allowed --mypy-config-file python/pyproject.toml

# the notebooks of docs/notebooks, executed; figures into target/notebooks
notebooks: python
    .venv/bin/pip install --quiet './python[notebooks]'
    .venv/bin/python docs/notebooks/run.py target/notebooks

# lenstronomy's own tests of LensModel, unchanged, with haloray's in its place
lenstronomy-tests: python
    .venv/bin/python data/oracle/lenstronomy_tests.py target/lenstronomy

# source distribution and self-contained wheel (HDF5 inside) into target/wheel, checked in an environment of its own
wheel:
    bash python/check_wheel.sh target/wheel

# conda-forge's recipe rendered for its platforms (a build needs its channel: `rattler-build build --recipe python/conda/recipe.yaml`)
conda:
    python3 -m venv target/conda_venv
    target/conda_venv/bin/pip install --quiet py-rattler-build==0.73.0
    target/conda_venv/bin/python python/conda/check.py

# the slow tests, which `just test` leaves out; writes docs/NIGHTLY.md
nightly:
    bash .ci/nightly

# the pages of small runs in headless Chromium (Debian's `chromium`): sizes, light and dark, controls, axe; screenshots into target/pages/shots; WHICH=long for kinds that take minutes too
pages WHICH="":
    cargo build --release
    python3 -m venv target/pages/venv
    target/pages/venv/bin/pip install --quiet playwright==1.65.2 axe-playwright-python==0.1.8
    target/pages/venv/bin/python tests/pages/check.py target/release/haloray target/pages {{WHICH}}

# the site of docs/ into target/site; any warning, dead link or misspelling stops it (offline once its packages are installed)
site:
    python3 -m venv target/site_venv
    target/site_venv/bin/pip install --quiet -r docs/requirements.txt
    target/site_venv/bin/codespell --config docs/spelling.cfg README.md CHANGELOG.md docs python/README.md examples
    target/site_venv/bin/sphinx-build -q -W --keep-going -b html -d target/site_doctrees docs target/site

# runs every code block of the tutorials, how-tos and the README, and compares what they print; PYTHON has the haloray package
site-check BINARY="target/release/haloray" PYTHON=".venv/bin/python":
    {{PYTHON}} -m pip install --quiet -r tests/site/requirements.txt
    python3 tests/site/check.py --binary {{BINARY}} --python {{PYTHON}}
    python3 tests/site/reference.py {{BINARY}} --check

# the pages of the command line and of the configuration, as the binary describes itself
site-reference BINARY="target/release/haloray":
    python3 tests/site/reference.py {{BINARY}}

# the figures of the gallery
site-gallery BINARY="target/release/haloray" PYTHON=".venv/bin/python":
    bash tests/site/gallery.sh {{BINARY}} {{PYTHON}}

# the site in headless Chromium (Debian's `chromium`): its search, sizes, light and dark, axe; screenshots into target/site_shots to be looked at
site-look: site
    target/site_venv/bin/pip install --quiet playwright==1.65.2 axe-playwright-python==0.1.8
    target/site_venv/bin/python tests/site/browse.py target/site target/site_shots

# the property tests with other numbers, and ten times as many
properties SEED:
    PROPTEST_RNG_SEED={{SEED}} PROPTEST_CASES=2560 cargo test --release --test properties -- multiplane:: tensors::

# everything the continuous check does
check:
    bash .ci/run

# Python packages of the oracles and reference scripts, in ./.venv
oracle-setup:
    python3 -m venv .venv
    .venv/bin/pip install --quiet lenstronomy==1.14.2 colossus==1.4.0 "astropy>=8" h5py mpmath
    .venv/bin/pip install --quiet arviz==0.22.0 emcee h5netcdf netcdf4

# make every reference file of data/reference again
reference: oracle-setup
    for script in data/reference/make_*.py; do .venv/bin/python "$script"; done

# ArviZ opens a posterior.nc, through both netCDF readers
arviz: oracle-setup
    mkdir -p target/arviz
    HALORAY_POSTERIOR_FOLDER=target/arviz cargo test --release --lib leaves_a_file_for_arviz -- --ignored
    .venv/bin/python data/netcdf/check_posterior.py target/arviz/posterior.nc

# xarray opens the table of an ensemble, through both netCDF readers
xarray: oracle-setup
    .venv/bin/pip install --quiet xarray
    cargo run --release -- ensemble -n 20 -o target/xarray
    .venv/bin/python data/netcdf/check_sightlines.py target/xarray/sightlines.h5

# long comparison with lenstronomy on a full cone; writes docs/ORACLE.md
oracle: oracle-setup
    cargo build --release
    .venv/bin/python data/oracle/compare_cone.py --binary target/release/haloray --summary docs/ORACLE.md

# 100 sightlines against their tidal and flexion models; writes docs/TIDAL_STUDY.md
study:
    printf '[maps]\npoints = 61\nhalf_width_arcsec = 2.5\n' > target/maps.toml
    cargo run --release -- study tidal target/maps.toml -n 100 -o tidal_study
    python3 data/oracle/page.py docs/TIDAL_STUDY.md "haloray study tidal target/maps.toml -n 100 -o tidal_study" tidal_study/result.md

# what the shear cut leaves out of one sightline; writes docs/CUT_STUDY.md
cut:
    printf '[line_of_sight]\nreference = "straight"\n' > target/straight.toml
    cargo run --release -- study cut target/straight.toml -o cut
    python3 data/oracle/page.py docs/CUT_STUDY.md "haloray study cut target/straight.toml -o cut" cut/result.md

# what truncation and scatter of haloes change; writes docs/HALO_CHOICES.md
haloes:
    cargo run --release -- study haloes --preset consistent -n 60 -o halo_choices
    python3 data/oracle/page.py docs/HALO_CHOICES.md "haloray study haloes --preset consistent -n 60 -o halo_choices" halo_choices/result.md

# which γ_LOS fits measure, an hour; writes docs/WHICH_SHEAR.md
which-shear:
    printf '[source]\nsersic_index = 1.0\n' > target/n1.toml
    cargo run --release -- study which-shear target/n1.toml --preset consistent -n 35 -o which_shear
    python3 data/oracle/page.py docs/WHICH_SHEAR.md "haloray study which-shear target/n1.toml --preset consistent -n 35 -o which_shear" which_shear/result.md

# when tidal models are good enough, an hour; writes docs/VALIDITY.md and its table
validity N="1000":
    cargo run --release -- study validity --preset consistent --set source.sersic_index=1 --set image.pixel_sampling=point -n {{N}} \
        --views all,0.1 --starts truth --no-delays --estimate laplace -o validity
    python3 data/oracle/page.py docs/VALIDITY.md "just validity {{N}}" validity/result.md
    cp validity/validity.h5 data/results/validity.h5

# which γ_LOS is to be expected of six real lenses; writes docs/EXPECTED.md
expected N="1000":
    cargo run --release -- study expected --preset consistent --lenses examples/expected_shear/lenses.csv -n {{N}} -o expected
    python3 data/oracle/page.py docs/EXPECTED.md "haloray study expected --preset consistent --lenses examples/expected_shear/lenses.csv -n {{N}} -o expected" expected/result.md

# full against minimal model on Table 1's image; writes docs/ADVANTAGE.md
advantage:
    cargo run --release -- study advantage -o advantage
    python3 data/oracle/page.py docs/ADVANTAGE.md "haloray study advantage -o advantage" advantage/result.md

# our benchmarks
bench:
    cargo bench

# lenstronomy beside us in one run, and how times grow with haloes and rays; writes docs/BENCHMARKS.md and its figure
bench-peers: oracle-setup
    cargo build --release
    bench=$(cargo bench --bench adaptive --no-run 2>&1 | sed -n 's/.*(\(.*adaptive-[0-9a-f]*\))/\1/p') && \
    .venv/bin/python data/oracle/bench_lenstronomy.py --binary target/release/haloray --bench "$bench" --scaling --summary docs/BENCHMARKS.md

# images through main lenses, adaptive beside exact in one run; writes docs/LENS_SPEED.md
bench-lenses:
    cargo bench --bench adaptive -- lenses | python3 data/oracle/page.py docs/LENS_SPEED.md "just bench-lenses"

# ten thousand sightlines beside single simulations in one run; writes docs/ENSEMBLE_SPEED.md
bench-ensemble N="10000":
    cargo build --release
    python3 data/oracle/bench_ensemble.py --binary target/release/haloray --number {{N}} --summary docs/ENSEMBLE_SPEED.md

# the elliptical power law beside lenstronomy's in one run; writes docs/PROFILE_SPEED.md
bench-lens: oracle-setup
    bench=$(cargo bench --bench lens --no-run 2>&1 | sed -n 's/.*(\(.*lens-[0-9a-f]*\))/\1/p') && \
    .venv/bin/python data/oracle/bench_lens.py --bench "$bench" --summary docs/PROFILE_SPEED.md

# are posteriors right? 200 systems drawn from a prior and fitted under it; writes docs/CALIBRATION.md
calibration:
    cargo run --release -- study calibration -n 200 --seed 1 -o calibration
    python3 data/oracle/page.py docs/CALIBRATION.md "haloray study calibration -n 200 --seed 1 -o calibration" calibration/result.md

# the same of stars and dark haloes, an hour; writes docs/COMPOSITE_CALIBRATION.md
composite-calibration:
    cargo run --release -- study calibration --model comprehensive -n 200 --seed 1 -o composite_calibration
    python3 data/oracle/page.py docs/COMPOSITE_CALIBRATION.md "haloray study calibration --model comprehensive -n 200 --seed 1 -o composite_calibration" \
        composite_calibration/result.md

# what flat priors do to γ_LOS of composite lenses: posteriors beside profile likelihoods, an hour; writes docs/FLAT_PRIORS.md
flat-priors:
    cargo run --release -- mock -n 64 --seed 201 --no-perturbers -o flat_priors
    cargo run --release -- study catalogue flat_priors --models comprehensive --profile
    python3 data/oracle/page.py docs/FLAT_PRIORS.md "haloray study catalogue flat_priors --models comprehensive --profile" flat_priors/study/result.md

# images of simulations fitted through their own haloes, an hour; writes docs/CLOSURE.md
closure:
    cargo build --release
    python3 data/oracle/closure.py --binary target/release/haloray --folder target/closure --summary docs/CLOSURE.md

# do fits of simulated images end as high as climbs from the truth? Two hours for 60 seeds of each preset; writes docs/SIMULATION_FITS.md
simulation-fits PRESETS="paper:60,consistent:60":
    cargo build --release
    python3 data/oracle/simulation_fits.py --binary target/release/haloray --presets {{PRESETS}} --folder target/simulation_fits --summary docs/SIMULATION_FITS.md

# do blind starts find the truth? 100 images around Table 1 under flat priors; writes docs/BLIND_STARTS.md
blind-starts:
    cargo run --release --example blind_starts | python3 data/oracle/page.py docs/BLIND_STARTS.md "just blind-starts"

# do starts of composite lenses end as high as climbs from the truth? 64 systems of each seed; writes docs/COMPOSITE_STARTS.md
composite-starts SEEDS="204":
    cargo run --release --example composite_starts -- 64 {{SEEDS}} | python3 data/oracle/page.py docs/COMPOSITE_STARTS.md "just composite-starts '{{SEEDS}}'"

# samplers beside each other on the same posteriors, from the same starts; writes docs/BAKE_OFF.md
bake-off OPTIONS="": python
    .venv/bin/pip install --quiet arviz==0.22.0 walnutpie==0.0.3
    .venv/bin/python data/oracle/bake_off.py {{OPTIONS}} --folder target/bake_off --summary docs/BAKE_OFF.md

# section 3: 64 images fitted with four models, under two hours on two cores; writes docs/CATALOGUE.md
catalogue:
    cargo run --release -- mock -n 64 --seed 1 -o catalogue
    cargo run --release -- study catalogue catalogue
    python3 data/oracle/page.py docs/CATALOGUE.md "haloray study catalogue catalogue" catalogue/study/result.md

# two fits of each of 40 composite lenses that differ in their seed; writes docs/TWO_SEEDS.md, in half an hour
two-seeds:
    cargo build --release
    python3 data/oracle/two_seeds.py --binary target/release/haloray --folder target/two_seeds --summary docs/TWO_SEEDS.md

# the posteriors of four small images beside chains that start at the truth, as the authors' did (docs/PAPER_CATALOGUE.md)
chains:
    cargo run --release -- mock -n 64 --seed 1 -o catalogue
    cargo run --release --example chains_from_the_truth -- catalogue 0 4 18 39

# a lenstronomy image fitted by haloray and by emcee on lenstronomy's likelihood; writes docs/FIT_SPEED.md
bench-fit: oracle-setup
    .venv/bin/pip install --quiet emcee==3.1.6
    cargo build --release
    bench=$(cargo bench --bench fit --no-run 2>&1 | sed -n 's/.*(\(.*fit-[0-9a-f]*\))/\1/p') && \
    .venv/bin/python data/oracle/bench_fit.py --binary target/release/haloray --bench "$bench" \
        --samplers valley,nuts --min-ess 1500 --summary docs/FIT_SPEED.md

# all our samplers beside nested sampling (nautilus) of lenstronomy's likelihood, an hour; writes docs/FIT_NESTED.md
bench-nested: oracle-setup
    .venv/bin/pip install --quiet emcee==3.1.6 nautilus-sampler==1.0.6
    cargo build --release
    .venv/bin/python data/oracle/nested_lenstronomy.py --binary target/release/haloray --live 1000 --effective 10000 \
        --summary docs/FIT_NESTED.md

# mutated inputs of every format through library and binary; counts into docs/RELIABILITY.md
fuzz MINUTES="10" SEED="1":
    cargo build --release --bin haloray --example fuzz
    nice -n 19 target/release/examples/fuzz target/release/haloray {{MINUTES}} {{SEED}} docs/RELIABILITY.md

# SIGKILL at N random moments of every kind of command; counts into docs/RELIABILITY.md
kills N="1000":
    cargo build --release
    python3 data/oracle/kills.py target/release/haloray {{N}} docs/RELIABILITY.md

# every command on 1, 2 and 7 threads and with FMA masked; counts into docs/RELIABILITY.md
same-bytes:
    cargo build --release
    python3 data/oracle/same_bytes.py target/release/haloray docs/RELIABILITY.md

# licences, sources and advisories of all crates (deny.toml); where github.com, which has the advisories, is out of reach: `just deny "licenses bans sources"`
deny WHAT="":
    cargo install --locked --quiet --root target/deny cargo-deny@0.20.2
    target/deny/bin/cargo-deny check {{WHAT}}

# an ensemble on a one-node Slurm that the check starts itself (root; Debian's slurm-wlm): a task killed, the node drained
slurm:
    $(command -v sudo) apt-get install -y slurm-wlm munge
    cargo build --release
    $(command -v sudo) bash tests/slurm/check.sh target/release/haloray

# sightlines from a fake light cone of N haloes (24 bytes of disk each) against brute force; seconds and memory into docs/howto/lightcone.md
lightcone N="100000000": oracle-setup
    cargo build --release
    .venv/bin/python data/oracle/lightcone.py --binary target/release/haloray --haloes {{N}} --summary docs/howto/lightcone.md
