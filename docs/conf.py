"""Settings of the documentation site; `make docs` builds it into build/docs, without network."""

import os
import sys
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

sys.path.insert(0, str(Path(__file__).parent / "_ext"))

import rosdoc2_copy

ROOT = rosdoc2_copy.documents(Path(__file__)).parent
sys.path.insert(0, str(ROOT))
rosdoc2_settings = rosdoc2_copy.SETTINGS

project = "leg_wear_monitor"
author = "leg_wear_monitor maintainers"
copyright = author
version = release = ElementTree.parse(ROOT / "package.xml").findtext("version") or "unknown"

extensions = [
    "example_page",
    "myst_parser",
    "numpydoc",
    "root_pages",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx_click",
    "sphinx_design",
    "sphinx_gallery.gen_gallery",
    "three_clicks",
]
exclude_patterns = [
    "_ext",
    "lessons/index.rst",  # in tutorials/index.rst
    "tutorials/GALLERY_HEADER.rst",
    "validation",
    *rosdoc2_copy.PAGES,
]
nitpicky = True

# Pages are read on a forge, too: headings have its anchors, and links are those of plain Markdown.
myst_heading_anchors = 4
myst_enable_extensions = ["colon_fence", "deflist"]

autosummary_generate = False
autodoc_member_order = "bysource"
autodoc_typehints = "none"  # the docstrings have types, with shapes and units
numpydoc_show_class_members = False

default_role = "literal"  # in docstrings, single backticks mark names


def _plain_help(_app: object, _context: object, lines: list[str]) -> None:
    """Help texts are plain: their asterisks are no emphasis, and an argument without a name is not listed."""
    if lines[:1] == [".. option:: "]:
        lines.clear()
    lines[:] = [line.replace("*", r"\*") for line in lines]


def setup(app: Any) -> None:
    """Sphinx calls this."""
    for part in ("arguments", "options"):
        app.connect(f"sphinx-click-process-{part}", _plain_help)


# The tutorials run while the site is built, and one that fails stops the build.
os.environ["PATH"] = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"  # leg-wear-monitor
sphinx_gallery_conf = {
    "examples_dirs": "tutorials",
    "gallery_dirs": "lessons",
    "filename_pattern": r"\d_",
    "copyfile_regex": "(?!)",  # nothing; an empty one would match index.rst
    "within_subsection_order": "FileNameSortKey",
    "abort_on_example_error": True,
    "run_stale_examples": True,  # the package may have changed
    "reset_modules": ("matplotlib",),
    "image_srcset": ["2x"],
    "first_notebook_cell": "%matplotlib inline",
    "doc_module": ("leg_wear_monitor",),
    "download_all_examples": False,
    "write_computation_times": False,
    "min_reported_time": 3600,  # s; the time of a build is no property of a tutorial
    "show_signature": False,
}

html_theme = "pydata_sphinx_theme"
html_context = {"default_mode": "auto"}  # light or dark as the browser is
html_title = f"leg_wear_monitor {version}"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_favicon = "_static/logo.svg"
html_extra_path = [str(ROOT / "docs" / "knee_breaks.png")]
html_search_scorer = str(ROOT / "docs" / "_static" / "search_scorer.js")
html_copy_source = False
html_show_sourcelink = False
html_theme_options = {
    "logo": {
        "text": html_title,
        "image_light": "_static/logo.svg",
        "image_dark": "_static/logo.svg",
        "alt_text": "",
    },
    "navbar_align": "left",
    "navigation_depth": 3,
    "show_toc_level": 2,
    "secondary_sidebar_items": {"[!l]**": ["page-toc"]},  # all but lessons/: what a terminal prints is wide
    "footer_start": ["copyright"],
    "footer_end": ["sphinx-version"],
}
