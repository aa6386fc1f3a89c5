"""The default results folder, whose name tells apart everything that makes results different.

That is the scene with each of its keys that is not as usual, and each option that changes a number, leaves out a part
or adds one. ``--no-figures`` is none of these: the numbers are the same.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from compare.pipeline import kind
from scenes.loading import distinguishes, shortened
from scenes.plan import Request
from scenes.units import POWER, TIME, VOLTAGE


def of(scene: Any, request: Request, settings: Sequence[str] = (), data: Sequence[str] = ()) -> Path:
    """The folder of a run, "results/sink-2V-width20um-steady", "results/device-273K-paper-figure9" or
    "results/bridge-left-electrode.voltage2"; ``settings`` are the overrides, and ``data`` a file to compare with and
    what is said of its columns."""
    asked = ["sensitivities"] * request.sensitivities
    asked += [] if request.uncertain is None else ["uncertain", *request.uncertain.given]
    fields = ["fields"] * request.fields
    if kind(scene) == "free":
        return _folder(scene.name, *_words(settings), *asked, *fields)
    if kind(scene) == "sink":
        words = [request.reduction.replace(":", "")] * (request.reduction != "paper")
        words += ["3d"] * (request.models == ("fem3d",)) + ["1d"] * (request.models == ("reduced1d",))
        words += ["steady"] * (not request.transient) + ["why"] * request.why + ["air"] * request.air
        words += [*asked, *request.data_uncertainty, *["calibrate"] * bool(request.calibrate), *request.calibrate]
        words += [f"monte-carlo-{request.monte_carlo}"] * (request.monte_carlo > 0)
        words += [*fields, *(TIME.show(time).replace(" ", "") for time in request.field_times)]
        words += ["against", data[0].replace("..", "up"), *data[1:]] if data else []
    else:
        words = ["3d"] * request.in_3d + ["paper"] * (request.scheme == "paper")
        words += [*request.about, request.meter or "", *asked]
        limits = (request.largest_voltage, VOLTAGE), (request.largest_power, POWER)
        words += [f"max{known.show(limit)}".replace(" ", "") for limit, known in limits if limit < float("inf")]
    # Overrides of what the checks are held to, which the scene's own text leaves out.
    found = (re.match(r"\s*(?:checks\.)?(tolerances|expect_differs)\b\.?(.*)", setting) for setting in settings)
    of_checks = [(match[2] or match[1]).replace("=", "") for match in found if match]
    return _folder(scene.name, distinguishes(scene), *words, *of_checks)


def of_sweep(scene: str, kind: str, settings: Sequence[str], *words: str) -> Path:
    """ "results/sink-sweep-width10um-200um-20-steady": what varies and what is overridden, then other options."""
    return _folder(f"{scene}-{kind}", *_words([re.sub("[:,]", "-", text) for text in settings]), *words)


def _words(settings: Sequence[str]) -> list[str]:
    words = []
    for setting in settings:
        key, _, value = setting.partition("=")
        value = "" if value.strip() == "true" else value.strip()  # "results/hotplate-steady"
        words.append((key.strip().partition(".")[2] or key) + re.sub("^-", "minus", value))
    return words


def _folder(name: str, *words: str) -> Path:
    safe = [re.sub(r"[^\w.+-]", "", re.sub(r"[\s/\\]+", "-", word.strip())).strip("-.") for word in words]
    return Path("results") / "-".join(filter(None, (name, shortened("-".join(filter(None, safe))))))
