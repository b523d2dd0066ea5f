"""Build the site: README, pages and a reference from the docstrings, by Sphinx.

`rems docs` builds it and opens it. It needs the extra `docs`, and no network.
"""

import sys
from pathlib import Path

_ROOT = Path(__file__).parent.parent
sys.path[:0] = [str(_ROOT), str(_ROOT / "docs" / "reference")]

from generated import document  # noqa: E402
from sources import read  # noqa: E402

project = "rems_net"
extensions = ["myst_parser", "sphinx.ext.autodoc"]
root_doc = "README"
include_patterns = ["*.md", "docs/*.md", "docs/reference/*.rst", "deploy/*.md"]
include_patterns += ["docs/measured/*.md", "firmware/esp32_woodbot/README.md"]
#: folders without pages, which Sphinx would walk through
exclude_patterns = ["**/.*", "rems_net", "tests", "benchmarks", "build", "dist", "runs"]
exclude_patterns += ["venv", "examples"]

myst_heading_anchors = 4
autodoc_typehints = "none"
autodoc_default_options = {"no-value": True}
autodoc_preserve_defaults = True
add_module_names = False
default_role = "code"
toc_object_entries = False

html_theme = "furo"
html_title = "rems_net"
html_copy_source = False
html_show_copyright = False
html_use_index = False
# Summaries of results are fetched page by page, which browsers refuse on a disk.
html_show_search_summary = False
html_theme_options = {"top_of_page_buttons": []}


def setup(app):
    """Connect the events of the build."""
    app.connect("source-read", read)
    app.connect("autodoc-process-docstring", document)
