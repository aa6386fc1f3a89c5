"""The documentation site: Sphinx with MyST.

Pages show the output of the commands on the day they are built, and the results of the notebook.
"""

import os
import shutil
import sys
from importlib import metadata
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent / "_ext"))
sys.path.insert(0, str(Path(__file__).parents[1]))

ROOT = Path(__file__).parents[1]
# Sphinx reads pages below this folder alone; a notebook runs beside the model that it judges.
shutil.copy(ROOT / "examples" / "own_model.ipynb", ROOT / "docs" / "howto" / "own_model.ipynb")
os.environ["PYTHONPATH"] = os.pathsep.join([str(ROOT / "examples"), str(ROOT), os.environ.get("PYTHONPATH", "")])

project = "heated-microstructure-validation"
author = "its contributors"
release = version = metadata.version(project)
extensions = ["myst_nb", "sphinx.ext.autodoc", "command", "mathml", "scene_keys"]
myst_enable_extensions = ["dollarmath", "amsmath", "colon_fence", "deflist"]
myst_heading_anchors = 3
source_suffix = {".md": "myst-nb", ".ipynb": "myst-nb"}
nb_execution_mode = "force"
nb_execution_timeout = 300  # s a cell
nb_execution_raise_on_error = True
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
