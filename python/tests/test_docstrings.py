"""Every public name says what it takes, returns and raises, in numpydoc's sections, with shapes and units."""

import dataclasses
import inspect
import re
from pathlib import Path

import public
import pytest

import haloray as hr

PAGE = Path(__file__).resolve().parents[2] / "docs" / "reference" / "python_api.md"
EVERY = {own.name: own for own in public.walk()}
#: Classes that haloray's Rust half makes are described in the stub; errors are their one sentence.
PLAIN = {"Config", "Error", "FileError", "InputError", "MissingFileError"}
FUNCTIONS = [
    name for name, own in EVERY.items() if not inspect.isclass(own.found) and not isinstance(own.found, property)
]
CLASSES = [name for name, own in EVERY.items() if inspect.isclass(own.found) and name not in PLAIN]
PROPERTIES = [name for name, own in EVERY.items() if isinstance(own.found, property)]
#: Words that give numbers a unit.
UNITS = ("arcsec", "days", "dimensionless", "e⁻/s", "km/s/Mpc", "Mpc", "solar mass", "units")


def sections(found):
    """The sections of a docstring by name, and its text before them under ""."""
    parts = re.split(r"^([A-Z][A-Za-z ]+)\n-{3,}\n", inspect.getdoc(found) or "", flags=re.MULTILINE)
    return {"": parts[0], **dict(zip(parts[1::2], parts[2::2]))}


def named(section):
    """The names that a section explains."""
    heads = [line.partition(" : ")[0] for line in section.splitlines() if line and not line.startswith(" ")]
    return {name.strip().lstrip("*") for head in heads for name in head.split(",")}


def arguments(found):
    return {name for name in inspect.signature(found).parameters if name not in ("self", "cls")}


@pytest.mark.parametrize("name", FUNCTIONS)
def test_a_function_says_what_it_takes_returns_and_raises(name):
    found = EVERY[name].found
    told, taken = sections(found), arguments(found)
    assert re.match(r"[A-Z].*\.$", told[""].strip().split("\n\n")[0], flags=re.DOTALL), "no first sentence"
    if taken:
        missing = taken - named(told.get("Parameters", ""))
        assert not missing, f"Parameters says nothing of {missing}"
        assert named(told["Parameters"]) <= taken, "Parameters has names that are no arguments"
        assert "Raises" in told, "Raises is missing"
    returns = str(inspect.signature(found).return_annotation)
    if returns != "None":
        assert "Returns" in told, "Returns is missing"
        if re.search(r"\bArray\b|\bfloat\b|^Any$|tuple\[Any", returns) and not name.startswith("figures."):
            text = inspect.getdoc(found)
            assert any(unit in text for unit in UNITS) or "plot" in name, "no units"
        if re.search(r"\bArray\b", returns):
            assert "shape" in told["Returns"], "no shape"


@pytest.mark.parametrize("name", CLASSES)
def test_a_class_explains_its_attributes_or_arguments(name):
    found = EVERY[name].found
    told = sections(found)
    assert told[""].strip(), "no sentence"
    if dataclasses.is_dataclass(found) or hasattr(found, "_fields"):
        fields = getattr(found, "_fields", None) or [own.name for own in dataclasses.fields(found)]
        missing = {own for own in fields if not own.startswith("_")} - named(told.get("Attributes", ""))
        assert not missing, f"Attributes says nothing of {missing}"
    else:
        assert {"Attributes", "Parameters"} & set(told), "neither Parameters nor Attributes"
    if "Parameters" in told:
        assert arguments(found) == named(told["Parameters"])


@pytest.mark.parametrize("name", PROPERTIES)
def test_a_property_has_a_sentence(name):
    assert (inspect.getdoc(EVERY[name].found) or "").rstrip().endswith((".", "1"))


def test_every_public_name_is_on_the_page_of_reference():
    page = PAGE.read_text(encoding="utf-8")
    missing = [name for name in hr.__all__ if not re.search(rf"haloray\.{name}\b", page)]
    assert not missing, missing
