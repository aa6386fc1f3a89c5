"""The section with the field: the picture of figure 4, and over it the scene that a browser with WebGL can turn."""

from __future__ import annotations

import base64
from pathlib import Path
from typing import TYPE_CHECKING

from scenes.formats import quantity
from validate.report.html.parts import section, text

if TYPE_CHECKING:
    from validate.report.figures.render import Field

PICTURES = ("figure4", "figure_field")
"""The figures that are a picture of the field."""


def show(folder: Path, field: Field | None) -> tuple[str, str]:
    """The section, and the script's data, empty where there is no field to turn; the picture is figure 4 if drawn."""
    picture = _picture(folder)
    if field is None:
        return section("Field", f'<figure class="field">{picture}</figure>' if picture else ""), ""
    import math

    import numpy as np

    from validate.report.figures import table
    from validate.report.html.surface import packed, surface

    data = packed(surface(field.points, field.hexes, field.rise), table(), field.factor)
    # No "</" may stand in a script; base64 has none, and this keeps it so whatever is added.
    script = '<script type="application/json" id="surface">' + data.replace("</", "<\\/") + "</script>"
    top = float(np.max(field.rise))
    most = max(2.5, math.log10(field.factor) + 0.5)
    factor = f"\N{MULTIPLICATION SIGN}{field.factor:g}" if field.factor > 1 else "true proportions"
    found = (
        '<figure class="field">'
        '<canvas class="scene" tabindex="0" role="img" aria-label="The temperature on the structure&#39;s surface; '
        'arrow keys turn it"></canvas>'
        '<div class="controls"><div class="bar"><div class="ramp"></div><div class="ends">'
        f"<span>0&nbsp;K</span><span>{text(field.label)}</span><span>{text(quantity(top, 'K', 4))}</span></div></div>"
        f'<label>thickness <input type="range" min="0" max="{most:.2f}" step="0.01" '
        f'value="{math.log10(field.factor):.4f}"> <output>{factor}</output></label>'
        "<span>drag to turn, wheel or pinch to zoom, double-click to start over</span></div>"
        f"{picture}<figcaption>The 3D temperature, {text(field.label)}; thickness exaggerated as stated.</figcaption>"
        "</figure>"
    )
    return section("Field", found), script


def _picture(folder: Path) -> str:
    path = next((folder / f"{name}.png" for name in PICTURES if (folder / f"{name}.png").exists()), None)
    if path is None:
        return ""
    source = base64.b64encode(path.read_bytes()).decode("ascii")
    return f'<div class="wide picture"><img src="data:image/png;base64,{source}" alt="The 3D temperature field"></div>'
