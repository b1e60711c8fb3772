"""Renders recipe.yaml for Linux and macOS with rattler-build, and holds it to what the package itself asks for.

    python python/conda/check.py        # needs Python 3.11 and py-rattler-build of PyPI

A build needs conda-forge's channel: `rattler-build build --recipe python/conda/recipe.yaml`.
"""

from pathlib import Path

import tomllib
from rattler_build import PlatformConfig, RenderConfig, Stage0Recipe, VariantConfig

HERE = Path(__file__).resolve().parent
project = tomllib.loads((HERE.parent / "pyproject.toml").read_text())
crate = tomllib.loads((HERE.parent / "Cargo.toml").read_text())

recipe = Stage0Recipe.from_file(HERE / "recipe.yaml")
# What conda-forge pins; the compilers are named by the platform.
PINNED = {"python": ["3.10.* *_cpython"], "c_stdlib": ["sysroot"], "c_stdlib_version": ["2.17"]}
for platform in ("linux-64", "linux-aarch64", "osx-arm64"):
    config = RenderConfig(
        platform=PlatformConfig(target_platform=platform, build_platform=platform, host_platform=platform)
    )
    for variant in recipe.render(VariantConfig(PINNED), config):
        found = variant.recipe.to_dict()
        assert found["package"]["version"] == crate["package"]["version"], found["package"]
        wanted = {own.replace(">=", " >=") for own in project["project"]["dependencies"]}
        wanted |= {own.replace(">=", " >=") for own in project["build-system"]["requires"]}
        asked = {str(own) for part in ("host", "run") for own in found["requirements"][part]}
        assert wanted <= asked, f"the recipe lacks {wanted - asked}"
        assert found["about"]["license"] == project["project"]["license"]
        print(platform, found["package"]["name"], found["package"]["version"], sorted(asked))
