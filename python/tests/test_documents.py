"""What the documents show in Python runs."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]


def blocks(name):
    return re.findall(r"```python\n(.*?)```", (ROOT / name).read_text(encoding="utf-8"), flags=re.DOTALL)


@pytest.mark.parametrize("name", ["README.md", "python/README.md"])
def test_the_example_of_a_readme(name):
    (example,) = blocks(name)
    exec(compile(example, name, "exec"), {})


def test_the_examples_of_the_page():
    for package in ("xarray", "pandas", "astropy"):
        pytest.importorskip(package)
    own = {}
    rays, lenstronomy, *_ = blocks("docs/PYTHON.md")
    exec(compile(rays + lenstronomy, "PYTHON.md", "exec"), own)
    assert own["mine"] == own["haloes"] and own["images"].is_complete
