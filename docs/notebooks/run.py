"""Executes the notebooks of this folder and leaves their figures as PNG, to be looked at.

Needs: pip install jupytext nbclient ipykernel matplotlib astropy xarray pandas, and haloray
Run:   python3 run.py FOLDER [NAME …]     figures go into FOLDER; all notebooks unless named
"""

import base64
import importlib.util
import pathlib
import sys
import time

import jupytext
from nbclient import NotebookClient

HERE = pathlib.Path(__file__).parent
#: What a notebook needs besides.
NEEDS = {"pyhalo_to_maps": "pyHalo"}


def main() -> int:
    folder = pathlib.Path(sys.argv[1])
    folder.mkdir(parents=True, exist_ok=True)
    begun = time.monotonic()
    for path in sorted(HERE.glob("*.md")):
        need = NEEDS.get(path.stem)
        if sys.argv[2:] and path.stem not in sys.argv[2:]:
            continue
        if need and importlib.util.find_spec(need) is None:
            print(f"{path.stem}: left out, {need} is not installed")
            continue
        start = time.monotonic()
        notebook = jupytext.read(path)
        NotebookClient(notebook, timeout=600, kernel_name="python3").execute()
        figures = 0
        for number, cell in enumerate(notebook.cells):
            for output in cell.get("outputs", []):
                data = output.get("data", {})
                if "image/png" in data:
                    figures += 1
                    (folder / f"{path.stem}_{number:02}.png").write_bytes(base64.b64decode(data["image/png"]))
                elif "text/plain" in data or "text" in output:
                    print(data.get("text/plain", output.get("text", "")))
        print(f"{path.stem}: {figures} figures, {time.monotonic() - start:.0f} s")
    print(f"all in {time.monotonic() - begun:.0f} s")
    return 0


if __name__ == "__main__":
    sys.exit(main())
