"""What is public: every function and class, and the methods and properties of the classes."""

import inspect
from collections.abc import Iterator
from typing import Any, NamedTuple

import haloray as hr


class Public(NamedTuple):
    """A public name, what it names, and the class that it is a member of."""

    name: str
    found: Any
    owner: type | None = None


def walk() -> Iterator[Public]:
    for module, prefix in ((hr, ""), (hr.figures, "figures.")):
        for name in module.__all__:
            found = getattr(module, name)
            if inspect.isclass(found):
                yield Public(prefix + name, found)
                yield from members(prefix + name, found)
            elif callable(found):
                yield Public(prefix + name, found)


def members(name: str, owner: type) -> Iterator[Public]:
    # Of errors and named tuples everything public is Python's.
    for own, found in vars(owner).items():
        if own.startswith("_") or own in getattr(owner, "_fields", ()):
            continue
        if isinstance(found, (classmethod, staticmethod)):
            found = found.__func__
        if inspect.isfunction(found) or isinstance(found, property):
            yield Public(f"{name}.{own}", found, owner)
