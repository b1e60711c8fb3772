"""Writes a reference table with the header that haloray's tests insist on."""

import datetime
import pathlib


def write(name, oracle, version, command, units, notes, columns):
    """Write `name`.csv beside this script; `columns` maps a column's name to its values."""
    path = pathlib.Path(__file__).resolve().parent / f"{name}.csv"
    names = list(columns)
    with open(path, "w", encoding="utf-8") as out:
        out.write(f"# oracle: {oracle}\n# version: {version}\n# command: {command}\n")
        out.write(f"# date: {datetime.date.today().isoformat()}\n# units: {units}\n")
        for note in notes:
            out.write(f"# note: {note}\n")
        out.write(",".join(names) + "\n")
        for row in zip(*(columns[column] for column in names)):
            out.write(",".join(row_value if isinstance(row_value, str) else f"{row_value:.10g}"
                               for row_value in row) + "\n")
    size = path.stat().st_size
    assert size < 100_000, f"{path} has {size} bytes"
    print(f"{path.name}: {len(columns[names[0]])} rows, {size} bytes")
