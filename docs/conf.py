"""How Sphinx builds the site: `just site`. The order of the pages is in `_toc.yml`."""

import os
import pathlib
import re
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "python"))

project = "haloray"
author = "the haloray authors"
copyright = "the haloray authors, MIT licence"
release = re.search(r'^version = "(.*)"', (ROOT / "Cargo.toml").read_text(encoding="utf-8"), re.MULTILINE)[1]

extensions = [
    "myst_nb",
    "sphinx_external_toc",
    "sphinx_copybutton",
    "sphinx-mathjax-offline",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
]
external_toc_path = "_toc.yml"
exclude_patterns = ["requirements.txt"]

# Notebooks are shown with their figures where haloray and what they import are installed beside Sphinx.
nb_execution_mode = "cache" if os.environ.get("HALORAY_NOTEBOOKS") else "off"
nb_execution_timeout = 600
nb_execution_raise_on_error = True

myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 3
suppress_warnings = ["toc.not_included"]  # a page that a command writes for the first time is found by search, not in the menu
nitpicky = True
nitpick_ignore_regex = [("py:.*", ".*")]  # types of other packages, whose pages this site does not read

# The Python package is documented from its source: its compiled half need not be built.
autodoc_mock_imports = ["haloray._haloray"]
autodoc_member_order = "bysource"
autodoc_typehints = "none"
napoleon_numpy_docstring = True
napoleon_google_docstring = False
napoleon_use_rtype = False
napoleon_use_ivar = True

html_theme = "furo"
html_title = "haloray"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_search_scorer = str(ROOT / "docs" / "scorer.js")
html_show_sourcelink = False
html_copy_source = False
html_theme_options = {"navigation_with_keys": True}

# What the theme leaves out and readers by ear or keyboard need: headings and their levels, names of regions, code and tables that scroll
# from the keyboard.
SPOKEN = {
    'role="heading">': 'role="heading" aria-level="2">',
    '<aside class="sidebar-drawer">': '<aside class="sidebar-drawer" aria-label="Pages">',
    '<aside class="toc-drawer">': '<aside class="toc-drawer" aria-label="On this page">',
    '<aside class="toc-drawer no-toc">': '<aside class="toc-drawer no-toc" aria-label="On this page">',
    "<pre>": '<pre tabindex="0">',
    '<table class="docutils': '<table tabindex="0" class="docutils',
    '<th class="head"><p></p></th>': "<td></td>",
    '<div id="search-results"></div>': '<h1>Search</h1><div id="search-results"></div>',
}


# γ_LOS as γ with LOS below it; code, formulas and scripts stay as they are.
LOWERED = re.compile(r"([\u0370-\u03ff][₁₂]?|\bA)_([A-Za-z0-9]+)")
AS_WRITTEN = re.compile(r"<(/?)(?:code|pre|script|style|title)\b")


def with_signs(html):
    """The page with what stands below the line put there."""
    pieces, depth = re.split(r"(<[^>]*>)", html), 0
    for number, piece in enumerate(pieces):
        if found := AS_WRITTEN.match(piece):
            depth += -1 if found[1] else 1
        elif depth == 0 and not piece.startswith("<") and "\\" not in piece:
            pieces[number] = LOWERED.sub(r"\1<sub>\2</sub>", piece)
    return "".join(pieces)


def make_speakable(app, failure):
    """Completes the pages that were written."""
    if failure or app.builder.format != "html":
        return
    for path in pathlib.Path(app.outdir).rglob("*.html"):
        text = written = path.read_text(encoding="utf-8")
        for left, whole in SPOKEN.items():
            text = text.replace(left, whole)
        text = with_signs(text)
        if text != written:
            path.write_text(text, encoding="utf-8")


def setup(app):
    app.connect("build-finished", make_speakable)
