"""Opens the page of every kind of run in Chromium: nothing overflows, nothing fails, controls do what they say, axe is content.

python3 tests/pages/check.py HALORAY OUT [long]   (Playwright's Python package and axe-playwright-python; Debian's `chromium`)
Runs small ones of every kind into OUT/runs unless they are there (those that take minutes only with `long`), and leaves screenshots in OUT/shots to be looked at.
"""

import os
import pathlib
import subprocess
import sys

from axe_playwright_python.sync_playwright import Axe
from playwright.sync_api import sync_playwright

CONFIG = """[haloes]
min_point_shear = 1e-5
[image]
pixels = 28
pixel_sampling = "adaptive"
[instrument]
pixel_scale_arcsec = 0.16
psf_fwhm_arcsec = 0.16
[source]
sersic_index = 1.0
[maps]
points = 41
"""
MODEL = """name = "small"
[[lens]]
profile = "EPL"
[lens.parameters]
theta_E = { uniform = [0.5, 2.5] }
gamma = { normal = [2.5, 0.2] }
e1 = { normal = [0.0, 0.1] }
e2 = { normal = [0.0, 0.1] }
[[source]]
profile = "SERSIC"
[source.parameters]
R_sersic = { log_normal = [0.3, 0.5] }
n_sersic = 1.0
center_x = { uniform = [-0.2, 0.2] }
center_y = { uniform = [-0.2, 0.2] }
"""
LENSES = """name,z_lens,z_source,theta_E_arcsec
near,0.3,1.2,1.0
far,0.6,1.8,0.8
"""
RUNS = {
    "simulate": "simulate small.toml --curves -o simulate",
    "fit": "fit simulate/image_all_haloes.fits --model small_model.toml --max-draws 60 -o fit",
    "tidal": "study tidal small.toml -n 3 -o tidal",
    "cut": "study cut small.toml --cuts 1e-3,1e-4,1e-5 -o cut",
    "haloes": "study haloes small.toml -n 2 -o haloes",
    "mock": "mock -n 9 -o mock",
    "ensemble": "ensemble small.toml -n 24 -o ensemble",
    "calibration": "study calibration -n 2 -o calibration",
    "validity": "study validity small.toml -n 4 --views all,0.1 --starts truth --estimate laplace --no-delays -o validity",
    "expected": "study expected small.toml --lenses lenses.csv -n 6 -o expected",
    "map": "map small.toml --curves -o map",
    "image": "image small.toml -o image",
    "images": "images point.json --source 0.1,0.05 -o images",
    "paper": "study tidal small.toml -n 3 --style paper -o paper",
    "dark": "study cut small.toml --cuts 1e-3,1e-4,1e-5 --style dark --format svg,pdf -o dark",
}
LONG = {
    "catalogue": "study catalogue mock --models power-law --first 2 --max-draws 60 -o catalogue",
    "advantage": "study advantage -o advantage",
    "which": "study which-shear small.toml -n 2 -o which",
}
POINT_LENS = pathlib.Path(__file__).resolve().parents[2] / "examples/point_source/model.json"
# 1: a short fit has not converged, which its page must say.
EXIT_CODES = {"fit": (1,), "catalogue": (0, 1)}
# Names of figures with a frame that sticks out of their page.
CUT_OFF = """[...document.querySelectorAll("figure svg")].filter(svg => [...svg.querySelectorAll(":scope > rect, :scope > g > rect")]
  .some(r => r.x.baseVal.value + r.width.baseVal.value > svg.viewBox.baseVal.width + 0.1)).map(svg => svg.closest("figure").id)"""
SIZES = {360: 740, 800: 1000, 1600: 1000}
SERIOUS = {"serious", "critical"}


def run_all(binary, folder, runs):
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "small.toml").write_text(CONFIG)
    (folder / "small_model.toml").write_text(MODEL)
    (folder / "lenses.csv").write_text(LENSES)
    (folder / "point.json").write_text(POINT_LENS.read_text())
    environment = os.environ | {"HDF5_USE_FILE_LOCKING": "FALSE"}
    for name, command in runs.items():
        if not (folder / name / "report.html").exists():
            done = subprocess.run([binary, *command.split(), "--quiet"], cwd=folder, env=environment)
            assert done.returncode in EXIT_CODES.get(name, (0,)), f"{name}: exit {done.returncode}"
        else:
            subprocess.run([binary, "report", name, "--quiet", "--overwrite"], cwd=folder, env=environment, check=True)


def controls_work(page, name):
    """Everything that can be pressed does what it says."""
    for section in page.locator("section.grid").all():
        canvas, told, which = section.locator("canvas").first, section.locator("output"), section.locator("select").first
        pixels = lambda: canvas.evaluate("c => c.toDataURL()")
        whole = pixels()
        canvas.focus()
        page.keyboard.press("ArrowRight")
        assert "θ = (" in told.inner_text(), f"{name}: nothing is read off"
        first = told.inner_text()
        page.keyboard.press("ArrowUp")
        assert told.inner_text() != first, f"{name}: arrows do not move"
        page.keyboard.press("+")
        assert pixels() != whole, f"{name}: nothing is zoomed"
        page.keyboard.press("0")
        box = canvas.bounding_box()
        canvas.hover(position={"x": box["width"] / 3, "y": box["height"] / 3})
        assert "−" in told.inner_text(), f"{name}: {told.inner_text()} left of the middle"
        shown = set()
        for option in which.locator("option").all():
            which.select_option(option.get_attribute("value"))
            shown.add((option.inner_text(), pixels()))
        assert len({image for _, image in shown}) == len(shown), f"{name}: two quantities look the same"
        which.select_option("0")
    for section in page.locator("section.corner").all():
        frames, boxes = section.locator(".panels .frame"), section.locator("input[type=checkbox]")
        panels = lambda count: count * (count + 1) // 2
        assert boxes.count() > 1 and frames.count() == panels(section.locator("input:checked").count()) > 1, f"{name}: panels"
        section.get_by_role("button", name="All", exact=True).click()
        assert frames.count() == panels(boxes.count()), f"{name}: not every pair has a panel"
        section.get_by_role("button", name="None", exact=True).click()
        assert frames.count() == 0 and "Choose" in section.locator("output").inner_text(), f"{name}: panels of nothing"
        boxes.first.focus()
        page.keyboard.press("Space")
        boxes.nth(1).check()
        assert frames.count() == 3, f"{name}: two parameters have three panels"
        drawn = section.locator(".panels .draws").get_attribute("d")
        assert drawn.count("M") > 50, f"{name}: {drawn.count('M')} draws"
        section.get_by_role("button", name="As at first").click()
    for details in page.locator("details").all():
        details.locator("summary").click()
        assert details.get_attribute("open") is not None, name
    for table in page.locator("table").all():
        heads = table.locator("th button")
        column = max(range(heads.count()), key=lambda k: table.locator(f"tbody td:nth-child({k + 1})[data-v]").count())
        cells = table.locator(f"tbody td:nth-child({column + 1})[data-v]")
        values = lambda: [float(cell.get_attribute("data-v")) for cell in cells.all()]
        heads.nth(column).click()
        assert values() == sorted(values()), f"{name}: not sorted upwards"
        heads.nth(column).click()
        assert values() == sorted(values(), reverse=True), f"{name}: not sorted downwards"
    term = page.locator("a.term").first
    if term.count():
        term.focus()
        assert page.locator("#tip").is_visible() and len(page.locator("#tip").inner_text()) > 10, f"{name}: no meaning"
        page.keyboard.press("Escape")
        assert not page.locator("#tip").is_visible(), name
    before = page.evaluate("getComputedStyle(document.body).backgroundColor")
    page.locator("#theme").click()
    assert page.evaluate("getComputedStyle(document.body).backgroundColor") != before, f"{name}: no other theme"
    page.locator("#theme").click()


def main(binary, out, which=""):
    binary, out = str(pathlib.Path(binary).resolve()), pathlib.Path(out).resolve()
    runs = RUNS | (LONG if which == "long" else {})
    run_all(binary, out / "runs", runs)
    shots = out / "shots"
    shots.mkdir(parents=True, exist_ok=True)
    faults = []
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path="/usr/bin/chromium", args=["--no-sandbox"])
        for name in runs:
            path = out / "runs" / name / "report.html"
            assert path.stat().st_size < 5e6, f"{name}: {path.stat().st_size} bytes"
            for width, height in SIZES.items():
                for scheme in ("light", "dark"):
                    context = browser.new_context(viewport={"width": width, "height": height}, color_scheme=scheme, offline=True)
                    page = context.new_page()
                    where = f"{name} {width} {scheme}"
                    page.on("console", lambda message: faults.append(f"{where}: console {message.text}") if message.type in ("error", "warning") else None)
                    page.on("pageerror", lambda error: faults.append(f"{where}: {error}"))
                    page.on("request", lambda request: faults.append(f"{where}: asks for {request.url[:80]}") if not request.url.startswith(("file:", "data:")) else None)
                    page.goto(path.as_uri())
                    ready = page.evaluate("performance.now()")
                    print(f"{where}: {ready:.0f} ms")
                    over = page.evaluate("document.documentElement.scrollWidth - document.documentElement.clientWidth")
                    if over > 0:
                        faults.append(f"{where}: {over} px too wide")
                    faults += [f"{where}: {cut} is cut off" for cut in page.evaluate(CUT_OFF)]
                    page.screenshot(path=shots / f"{name}_{width}_{scheme}.png", full_page=True)
                    if width == 800 and scheme == "light":
                        controls_work(page, name)
                    results = Axe().run(page).response["violations"]
                    for violation in results:
                        node = violation["nodes"][0]
                        text = f"{where}: axe {violation['impact']}: {violation['id']} {node['html'][:120]}"
                        (faults.append if violation["impact"] in SERIOUS else print)(text)
                    context.close()
        page = browser.new_page()
        page.goto((out / "runs" / "simulate" / "report.html").as_uri())
        page.pdf(path=shots / "simulate.pdf", format="A4")
        browser.close()
    print("\n".join(faults) or f"pages are right; look at them in {shots}")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
