"""The documentation site: Sphinx with MyST, in which pages show what the commands print on the day they are built."""

import sys
from importlib import metadata
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent / "_ext"))
sys.path.insert(0, str(Path(__file__).parents[1]))

project = "heated-microstructure-validation"
author = "its contributors"
release = version = metadata.version(project)
extensions = ["myst_parser", "sphinx.ext.autodoc", "command", "mathml"]
myst_enable_extensions = ["dollarmath", "amsmath", "colon_fence", "deflist"]
myst_heading_anchors = 3
source_suffix = {".md": "markdown"}
exclude_patterns = ["_ext", "_build"]
# Pages that other commands make may not be there yet; the contents leave room for them.
suppress_warnings = ["toc.not_readable"]
autodoc_member_order = "bysource"
autodoc_typehints = "description"
autodoc_typehints_format = "short"
html_theme = "furo"
html_title = "How far to trust a 1D model"
html_math_renderer = "mathml"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_copy_source = False
html_show_copyright = False
