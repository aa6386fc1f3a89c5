"""The document of a compact model (model.json): its matrices, inputs, outputs and errors, and the text about it.

Names of inputs and outputs are unique in each format, also where a format allows letters and digits alone.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from scenes import physics
from scenes.model import AnyScene, Material, Schedule, Value
from scenes.units import TIME
from statespace.channels import UNITS, Channel
from statespace.reduction import StateSpace

EQUATIONS = [
    "z = (1, inputs g, states b), b = 0 at t = 0; (A z) c = S z for the current fields c",
    "db/dt = F z + sum over pairs i <= j of c_i c_j Q_ij z (twice for i < j); 0 where steady_only",
    "rows = Y z + W dg/dt + sum_i c_i U_i z + sum over pairs of c_i c_j P_ij z; an output is the max, min or mean",
]
"""The equations of `statespace.runtime`, in words for a document."""


def scene_document(
    scene: AnyScene, name: str, inputs: Sequence[Channel], space: StateSpace, first_time: float
) -> dict[str, Any]:
    """Write the document of a scene's model, without errors; errors hold from ``first_time`` (s) on."""
    entries = [
        {"name": c.name, "unit": UNITS[c.kind], "kind": c.kind, "of": c.item, "rest": c.rest, "step": c.step,
         "range": [*c.range], "value": _plain(c.value)}
        for c in inputs
    ]  # fmt: skip
    span = (None, None) if scene.steady else (first_time, scene.end_time)
    return described(name, scene.initial_temperature, entries, space, span, physics.materials(scene))


def described(
    name: str, start: float, inputs: Sequence[dict[str, Any]], space: StateSpace,
    span: tuple[float | None, float | None], materials: Iterable[Material],
) -> dict[str, Any]:  # fmt: skip
    """Write the document of a state space that reads rises above the initial temperature ``start``  (K).
    It holds within a ``span`` of times (s), None for the steady state alone."""
    matrices = space.in_modes()[0]
    matrices["Y"][[*space.thermal, *(port.row for port in space.ports if port.unit == "K")], 0] += start
    outputs = [{"name": n, "unit": unit, "rows": at, "reduce": how} for n, (at, how, unit) in space.outputs.items()]
    entries = [entry | {"port": port._asdict()} for entry, port in zip(inputs, space.ports, strict=True)]
    return {
        "schema": 1, "equations": EQUATIONS, "scene": name, "steady_only": span[1] is None,
        "initial_temperature_K": start, "states": space.states, "inputs": entries, "outputs": outputs,
        "range": {
            "from_s": span[0], "to_s": span[1],
            "highest_temperature_K": min((m.valid_to for m in materials if m.valid_to is not None), default=None),
        },
        "matrices": {key: {"shape": [*m.shape], "values": m.ravel().tolist()} for key, m in matrices.items()},
    }  # fmt: skip


def _plain(value: Value) -> Any:
    return {"times": [*value.times], "values": [*value.values]} if isinstance(value, Schedule) else value


def facts(document: Mapping[str, Any]) -> list[str]:
    """Write the lines at the head of a file."""
    span = document["range"]
    when = "steady state" if document["steady_only"] else f"from rest to {TIME.show(span['to_s'])}"
    lines = [f'Compact model of "{document["scene"]}": {document["states"]} states, {when}.', "Inputs:"]
    for entry in document["inputs"]:
        low, high = entry["range"]
        lines.append(f"  {entry['name']} ({entry['unit']}), tried from {low:g} to {high:g}, at rest {entry['rest']:g}")
    lines.append("Outputs:")
    lines += [f"  {entry['name']} ({entry['unit']})" for entry in document["outputs"]]
    hottest = span["highest_temperature_K"]
    if hottest is not None:
        lines.append(f"Materials: valid up to {hottest:g} K.")
    lines += errors(document)
    return lines


def errors(document: Mapping[str, Any]) -> list[str]:
    """List the largest relative error in each run, and how it was estimated."""
    lines = []
    for run, kinds in document["error"].items():
        sentences = []
        for kind, each in kinds.items():
            worst = max(each, key=lambda name: each[name]["relative"])
            since = f" from {TIME.show(document['range']['from_s'])} on" if kind == "over time" else ""
            sentences.append(f"{kind}{since} {each[worst]['relative']:.1e} ({worst})")
        lines.append(f"  {run}: {', '.join(sentences)}")
    lines += [*document["estimated"]["text"], *(f"Warning: {text}." for text in document.get("warnings", ()))]
    return ["Largest error, relative to the largest rise, flow or current:", *lines]


def validity(document: Mapping[str, Any]) -> str:
    """State the number of states and the largest relative error."""
    each = [e["relative"] for run in document["error"].values() for kind in run.values() for e in kind.values()]
    return f"{document['states']} states, within {max(each):.1e} of the full model and its error"


_OF_THE_NETLIST = re.compile(r"(b|c|copy|rate|in)\d+|0|gnd")
"""Nodes that the netlist itself uses, and SPICE's names of ground."""


def names(document: Mapping[str, Any]) -> list[dict[str, str]]:
    """List the names of the inputs, then of the outputs: in Python ("name"), SPICE and the FMU.

    Upper and lower case are one to SPICE; the FMU has identifiers, as the structured names of FMI 2.0 take them.
    """
    inputs, outputs = ([entry["name"] for entry in document[kind]] for kind in ("inputs", "outputs"))
    plain = [*inputs, *outputs]
    nodes = _told_apart([*inputs, *(f"out_{name}" for name in outputs)], ignore_case=True)
    variables = _told_apart([re.sub(r"^(?=\d)", "_", name) for name in plain], ignore_case=False)
    return [
        {"name": name, "spice": node, "fmu": variable}
        for name, node, variable in zip(plain, nodes, variables, strict=True)
    ]


def _told_apart(names: Sequence[str], ignore_case: bool) -> list[str]:
    """The names in letters, digits and underscores of ASCII; one that another has already gets a number."""
    renamed: dict[str, str] = {}
    for name in names:
        plain = re.sub(r"[^A-Za-z0-9_]+", "_", name)
        said, number = plain, 1
        while (key := said.lower() if ignore_case else said) in renamed or (
            ignore_case and _OF_THE_NETLIST.fullmatch(key)
        ):
            number += 1
            said = f"{plain}_{number}"
        renamed[key] = said
    return list(renamed.values())
