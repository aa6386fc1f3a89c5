"""What a compact model says of itself: what it is for, within which range, how far off, and how that was found."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from scenes.units import TIME

EQUATIONS = [
    "z = (1, inputs g, states b), b = 0 at t = 0; (A z) c = S z for the current fields c",
    "db/dt = F z + sum over pairs i <= j of c_i c_j Q_ij z (twice for i < j); 0 where steady_only",
    "rows = Y z + W dg/dt + sum_i c_i U_i z + sum over pairs of c_i c_j P_ij z; an output is the max, min or mean",
]
"""The equations of `statespace.runtime`, in words for a document."""


def facts(document: Mapping[str, Any]) -> list[str]:
    """Lines for the head of a file."""
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
    """The largest relative error of each run that the model was held against, and how it was found."""
    lines = []
    for run, kinds in document["error"].items():
        sentences = []
        for kind, each in kinds.items():
            worst = max(each, key=lambda name: each[name]["relative"])
            since = f" from {TIME.show(document['range']['from_s'])} on" if kind == "over time" else ""
            sentences.append(f"{kind}{since} {each[worst]['relative']:.1e} ({worst})")
        lines.append(f"  {run}: {', '.join(sentences)}")
    return ["Largest error, relative to the largest rise, flow or current:", *lines, *document["estimated"]["text"]]


def validity(document: Mapping[str, Any]) -> str:
    """The worst of them in half a sentence."""
    each = [e["relative"] for run in document["error"].values() for kind in run.values() for e in kind.values()]
    return f"{document['states']} states, within {max(each):.1e} of the full model and its error"
