"""Opens the site in Chromium: its search answers a newcomer's questions, nothing overflows, nothing fails, axe is content.

python3 tests/site/browse.py target/site [SHOTS]   (Playwright's Python package and axe-playwright-python; Debian's `chromium`)
Leaves screenshots of all pages in SHOTS, to be looked at.
"""

import pathlib
import sys

from axe_playwright_python.sync_playwright import Axe
from playwright.sync_api import sync_playwright

# What a newcomer types, and the page that answers it. It must be among the first three results.
TASKS = {
    "run the paper": "howto/run_the_paper",
    "histogram delta_tot 20 sightlines": "howto/histogram_delta",
    "pyHalo": "tutorials/pyhalo",
    "N-body table": "howto/nbody_table",
    "figure from run.h5": "howto/plot_run_h5",
    "vary the lens loop": "howto/vary_the_lens",
    "fit HST cutout": "tutorials/cutout",
    "export lenstronomy": "howto/export_to_lenstronomy",
    "another telescope": "howto/another_telescope",
    "10,000 sightlines cluster": "tutorials/thousand_sightlines",
    # In words of their own, of which no page has all.
    "sweep parameters of the lens": "howto/vary_the_lens",
    "JWST depth": "howto/another_telescope",
    "install haloray": "start",
    "uninstall": "start",
    "simulate telescope xyzzy": "howto/another_telescope",
}
# The search says so when it has ended.
ENDED = "document.querySelector('.search-summary')?.textContent.match(/found|did not match/)"


def main():
    site = pathlib.Path(sys.argv[1]).resolve()
    shots = pathlib.Path(sys.argv[2]) if len(sys.argv) > 2 else None
    failures = []
    pages = sorted(str(path.relative_to(site).with_suffix("")) for path in site.rglob("*.html"))
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path="/usr/bin/chromium", args=["--no-sandbox"])
        page = browser.new_page()
        for query, answer in TASKS.items():
            page.goto(f"{site.as_uri()}/search.html?q={query.replace(' ', '+')}")
            page.wait_for_function(ENDED, timeout=20_000)
            page.wait_for_timeout(1000)
            links = page.eval_on_selector_all("ul.search > li > a", "found => found.map(link => link.href)")
            places = []
            for link in links:
                place = link.split("#")[0].split("?")[0].removeprefix(f"{site.as_uri()}/").removesuffix(".html")
                if place not in places:
                    places.append(place)
            rank = places.index(answer) + 1 if answer in places else None
            print(f"{query!r}: {answer} is result {rank} of {len(places)}; first {places[:3]}")
            if rank is None or rank > 3:
                failures.append(f"search {query!r} does not find {answer}")
        for width in (360, 1400):
            for scheme in ("light", "dark"):
                page = browser.new_page(viewport={"width": width, "height": 900}, color_scheme=scheme)
                page.on("console", lambda message: failures.append(message.text) if message.type == "error" else None)
                page.on("pageerror", lambda error: failures.append(str(error)))
                for name in pages:
                    page.goto(f"{site.as_uri()}/{name}.html")
                    page.wait_for_timeout(200)
                    wide = page.evaluate("document.documentElement.scrollWidth - document.documentElement.clientWidth")
                    if wide > 0:
                        failures.append(f"{name} at {width}: {wide} pixels too wide")
                    for violation in Axe().run(page, options={"preload": False}).response["violations"]:
                        node = violation["nodes"][0]["html"][:120]
                        text = f"{name} at {width} {scheme}: axe {violation['impact']}: {violation['id']} {node}"
                        failures.append(text)
                    if shots:
                        shots.mkdir(parents=True, exist_ok=True)
                        page.screenshot(path=shots / f"{name.replace('/', '_')}_{width}_{scheme}.png")
    for failure in failures:
        print("FAILED", failure)
    sys.exit(1 if failures else 0)


if __name__ == "__main__":
    main()
