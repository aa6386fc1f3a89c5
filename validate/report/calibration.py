"""What was fitted to data, in the terminal."""

from __future__ import annotations

from operator import attrgetter
from typing import TYPE_CHECKING

from scenes.formats import percent
from scenes.keys import type_of
from validate.report.sensitivities import short
from validate.report.table import Style, columns_text, wrapped

if TYPE_CHECKING:
    from compare.inputs.calibration import Fit


def fit_text(found: Fit, style: Style) -> str:
    """A line for each key, from where to where it went and how well it is known, and the scene that results."""
    paths = type_of(found.scene).schema.paths
    rows = [["fitted", "from", "to", "u", "95 % between", "and"]]
    for key, value in found.fitted.items():
        low, high = found.interval(key)
        shown = [f"{v:.4g}" for v in (found.start[key], value)]
        rows.append([short(key), *shown, percent(found.u[key]), f"{low:.4g}", f"{high:.4g}"])
    lines = columns_text(rows, 1, style)
    lines.append(
        wrapped(f"Misfit {found.misfit:.3g} of {found.points} points; values in SI units. The scene that results:")
    )
    for section in dict.fromkeys(key.rpartition(".")[0] for key in found.fitted):
        lines.append(f"  [{section}]")
        for key in (key for key in found.fitted if key.rpartition(".")[0] == section):
            lines.append(f"  {key.rpartition('.')[2]} = {attrgetter(paths[key].attribute)(found.scene)!r}")
    said = "A model that is fitted to data is not validated by them: what follows says how well it fits"
    return "\n".join([*lines, wrapped(f"{said}, other data whether it is right.")])
