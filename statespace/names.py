"""Names of a compact model's inputs and outputs in formats that allow few signs, unique in each."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Any

_OF_THE_NETLIST = re.compile(r"(b|c|copy|rate|in)\d+|0|gnd")
"""Nodes that the netlist itself uses, and SPICE's names of ground."""


def spice(document: Mapping[str, Any]) -> tuple[list[str], list[str]]:
    """The nodes of the inputs and of the outputs; upper and lower case are one to SPICE."""
    inputs = [entry["name"] for entry in document["inputs"]]
    outputs = [f"out_{entry['name']}" for entry in document["outputs"]]
    nodes = _told_apart([*inputs, *outputs], ignore_case=True)
    return nodes[: len(inputs)], nodes[len(inputs) :]


def fmu(document: Mapping[str, Any]) -> tuple[list[str], list[str]]:
    """The variables of the inputs and of the outputs, identifiers as the structured names of FMI 2.0 take them."""
    inputs, outputs = ([entry["name"] for entry in document[kind]] for kind in ("inputs", "outputs"))
    variables = _told_apart([re.sub(r"^(?=\d)", "_", name) for name in (*inputs, *outputs)], ignore_case=False)
    return variables[: len(inputs)], variables[len(inputs) :]


def listed(document: Mapping[str, Any]) -> list[dict[str, str]]:
    """What each input and each output is called: its ``name``, as in Python, in ``spice`` and in ``fmu``."""
    names = []
    for kind, nodes, variables in zip(("inputs", "outputs"), spice(document), fmu(document), strict=True):
        for entry, node, variable in zip(document[kind], nodes, variables, strict=True):
            names.append({"name": entry["name"], "spice": node, "fmu": variable})
    return names


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
