"""Reductions of the sink, each with one assumption less than its predecessor, behind one `solve`.

    paper           eq 20: eq 14's series resistance, eq 9's parabola, one lump, pads without heat capacity
    anchored        the same with the anchor resistance computed from the plate
    fin-massless    the heat equation along the beam on that resistance
    fin             ... and on the anchor's effective heat capacity
    plate           the heat equation of the silicon layer, averaged over its thickness
    moments:N       the plate projected on N fields that match its response

All of them take constant properties and a resistivity that is linear in the temperature. Where a property follows the
temperature by a law, or faces radiate, the first two take the numbers at room temperature, as the paper does, and the
others are refused: only 3D solves that.

Nothing heavy is imported before a reduction needs it.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from scenes.errors import SceneError, did_you_mean, quoted
from scenes.physics import refuse_laws

if TYPE_CHECKING:
    import numpy as np

    from reduced1d.ladder.levels import Levels
    from scenes.result import Result
    from scenes.sink import Sink

REDUCTIONS = {
    "paper": "eq 20",
    "anchored": "eq 20 with the anchor resistance of the plate",
    "fin-massless": "the heat equation along the beam, anchors without heat capacity",
    "fin": "the heat equation along the beam, anchors with their effective heat capacity",
    "plate": "the thickness-averaged heat equation of the silicon layer",
    "moments": "the plate projected on a few moment-matching fields",
}
CONSTANT = "paper", "anchored"
"""Reductions that take properties at room temperature even if they follow it (a resistivity with its slope)."""


def canonical(text: str) -> str:
    """The name of a reduction as it is reported: "moments" is "moments:4".

    Raises SceneError for one that there isn't, or a number of states that is none.
    """
    family, colon, number = text.partition(":")
    if family not in REDUCTIONS:
        raise SceneError(f"there is no reduction {quoted(text)}{did_you_mean(family, REDUCTIONS)}: {_choices()}")
    if family != "moments":
        if colon:
            raise SceneError(f"reduction {quoted(text)} takes no number of states: {_choices()}")
        return family
    if colon and not (number.isascii() and number.isdigit() and 1 <= int(number) <= 12):
        raise SceneError(f"reduction {quoted(text)} needs a number of states from 1 to 12, as moments:4")
    return f"moments:{int(number) if colon else 4}"


def is_one(text: str) -> bool:
    """Whether there is a reduction of this name, with or without a number of states."""
    return text.partition(":")[0] in REDUCTIONS


def describe(name: str) -> str:
    family, _, states = name.partition(":")
    return REDUCTIONS[family].replace("a few", states) if states else REDUCTIONS[family]


def solve(
    sink: Sink, reduction: str = "paper", *, steady_only: bool = False, times: np.ndarray | None = None,
    levels: Levels | None = None,
) -> Result:  # fmt: skip
    """The steady state and, unless ``steady_only``, the traces of a reduction of a sink, at ``times`` (s, ascending)
    or at times of its own up to the sink's end time.

    ``Result.model`` is the reduction's name; ``details`` has its "states", and of reductions that stand on the plate
    the "warnings" and the "thin_plate_remainder". ``levels`` saves the plate between several reductions of one sink.

    Raises SceneError for an unknown reduction, RunawayError where there is no steady state, ValueError for silicon that
    does not conduct.
    """
    name = canonical(reduction)
    refuse(sink, name)
    given, sink = sink, sink.plain
    from reduced1d.ladder.few_states import result

    if name == "paper":
        from reduced1d.equations import anchor_series_resistance
        from reduced1d.ladder.few_states import lumps

        # The paper's blocks touch perfectly.
        row = lumps(replace(sink, contact_resistance=None), anchor_series_resistance(sink))
        return result(name, sink, row, row, steady_only, times)
    from reduced1d.ladder.levels import Levels

    levels = levels or Levels(given)
    answer = result(name, sink, levels.fine.model(name), levels.coarse.model(name), steady_only, times)
    remainder, said = levels.fine.remainder, list[str]()
    if remainder > 1e-3:
        said.append(
            f"the thin-plate assumption ends here: with silicon of {sink.thickness * 1e6:.3g} um on oxide of "
            f"{sink.oxide_thickness * 1e6:.3g} um, the plate neglects up to {100 * remainder:.2g} % of the anchor "
            "resistance"
        )
    more = {"unknowns": levels.fine.plate.unknowns, "thin_plate_remainder": remainder, "warnings": said}
    return replace(answer, details={**answer.details, **more})


def refuse(sink: Sink, name: str) -> None:
    """Raise SceneError where a reduction does not exist for a row of spans, or for the sink's materials and faces."""
    refuse_laws(sink.materials, "a 1D model", "one number or law", ", or ask for the 3D solution alone")
    if name not in CONSTANT and sink != sink.plain:
        what = "radiates" if sink.emissivity else "has a property that follows the temperature by a law"
        raise SceneError(
            f"the sink {what}, and the reduction {name} takes constant properties and no radiation: give paper or "
            "anchored, which take those at room temperature, or --only 3d"
        )
    if sink.spans > 1 and name != "paper":
        raise SceneError(f"sink.spans = {sink.spans} makes a row, and {name} is made for one span: give paper")


def _choices() -> str:
    return f"give one of {', '.join(REDUCTIONS)} (moments:N with N states)"
