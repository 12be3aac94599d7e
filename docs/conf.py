"""Configuration of the documentation: `sphinx-build -W --keep-going -b html docs docs/_build/html`.

Nothing is fetched, neither when the pages are built nor when they are read: formulas become MathML,
and scripts, styles and fonts are those that the theme ships.
"""

from __future__ import annotations

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))  # the extensions beside this file

import rigdda

project = "rigdda"
author = "RIG-DDA Protect contributors"
copyright = author
version = release = rigdda.__version__

extensions = [
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "numpydoc",
    "myst_nb",
    "sphinx_copybutton",
    "extensions.mathml",
    "extensions.repository",
]
exclude_patterns = ["_build", "extensions"]
root_doc = "index"

# Markdown and notebooks. Every notebook runs at each build, in a folder of its own.
myst_enable_extensions = ["colon_fence", "dollarmath"]
myst_heading_anchors = 3
nb_execution_mode = "force"
nb_execution_in_temp = True
nb_execution_raise_on_error = True
nb_execution_timeout = 300
nb_ipywidgets_js: dict[str, dict[str, str]] = {}  # they would be fetched, and no page needs them
nb_merge_streams = True

# The reference from docstrings.
autosummary_generate = True
autosummary_ignore_module_all = False
autodoc_typehints = "none"
autodoc_default_options = {"member-order": "bysource"}
numpydoc_show_class_members = False  # the template lists them with their whole docstrings

templates_path = ["_templates"]
highlight_language = "none"  # of blocks that name no language

html_theme = "pydata_sphinx_theme"
html_title = f"rigdda {release}"
html_static_path = ["_static"]
html_sidebars = {"index": [], "benchmarks": []}  # pages without others beside them
html_css_files = ["rigdda.css"]
html_show_sourcelink = False
html_copy_source = False
html_math_renderer = "mathml"
html_theme_options = {
    "show_prev_next": True,
    "show_toc_level": 2,
    "navbar_align": "left",
    "footer_start": ["copyright"],
    "footer_end": [],
    "secondary_sidebar_items": ["page-toc"],
}
