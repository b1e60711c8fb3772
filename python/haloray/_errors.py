"""What can go wrong, as exceptions."""

from __future__ import annotations

__all__ = ["Error", "FileError", "InputError", "MissingFileError"]


class Error(Exception):
    """Base of every error of haloray.

    Attributes
    ----------
    hint : str
        One line that helps; empty where there is none.
    """

    hint: str = ""


class InputError(Error, ValueError):
    """A value, an array, a configuration or the content of a file is outside what is allowed; the message says what is."""


class FileError(Error, OSError):
    """A file cannot be read or written."""

    def __str__(self) -> str:
        return str(self.args[0]) if self.args else ""


class MissingFileError(FileError, FileNotFoundError):
    """A file is not there."""


for _error in (Error, InputError, FileError, MissingFileError):
    _error.__module__ = "haloray"
