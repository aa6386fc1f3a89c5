"""The default results folder, whose name tells apart everything that makes results different.

That is the scene with each of its keys that is not as usual, and each option that changes a number, leaves out a part
or adds one. ``--no-figures`` is none of these: the numbers are the same.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from compare.pipeline import kind
from scenes.loading import distinguishes, shortened
from scenes.units import POWER, TIME, VOLTAGE

if TYPE_CHECKING:
    from scenes.plan import Request


def of(scene: Any, request: Request, settings: Sequence[str] = (), data: Sequence[str] = ()) -> Path:
    """The folder of a run; ``settings`` are the overrides, and ``data`` a file to compare with and what is said of its
    columns."""
    if kind(scene) == "free":
        # "results/bridge", or with an override "results/bridge-left-electrode.voltage2"
        return _folder(scene.name, *_words(settings), *_asked(request), *["fields"] * request.fields)
    words = _of_sink(request, data) if kind(scene) == "sink" else _of_device(request)
    return _folder(scene.name, distinguishes(scene), *words, *_of_checks(settings))


def _of_sink(request: Request, data: Sequence[str]) -> list[str]:
    """ "results/sink-1V", "results/sink-2V-width20um-steady"."""
    words = [] if request.reduction == "paper" else [request.reduction.replace(":", "")]
    if len(request.models) == 1:
        words.append({"fem3d": "3d", "reduced1d": "1d"}[request.models[0]])
    words += (
        ["steady"] * (not request.transient)
        + ["why"] * request.why
        + ["air"] * request.air
        + _asked(request)
        + list(request.data_uncertainty)
        + (["calibrate", *request.calibrate] if request.calibrate else [])
        + [f"monte-carlo-{request.monte_carlo}"] * (request.monte_carlo > 0)
        + ["fields"] * request.fields
    )
    words += [TIME.show(time).replace(" ", "") for time in request.field_times]
    words += ["against", data[0].replace("..", "up"), *data[1:]] if data else []
    return words


def _asked(request: Request) -> list[str]:
    """What is asked of the inputs."""
    uncertain = [] if request.uncertain is None else ["uncertain", *request.uncertain.given]
    return ["sensitivities"] * request.sensitivities + uncertain


def _of_device(request: Request) -> list[str]:
    """ "results/device-273K", "results/device-273K-paper-figure9"."""
    words = ["3d"] * request.in_3d + ["paper"] * (request.scheme == "paper")
    words += [*request.about, *filter(None, [request.meter])] + ["sensitivities"] * request.sensitivities
    for limit, dimension in ((request.largest_voltage, VOLTAGE), (request.largest_power, POWER)):
        words += [f"max{dimension.show(limit)}".replace(" ", "")] if limit < float("inf") else []
    return words


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


def _of_checks(settings: Sequence[str]) -> list[str]:
    """Overrides of what the checks are held to, which the scene's own text leaves out."""
    found = (re.match(r"\s*(?:checks\.)?(tolerances|expect_differs)\b\.?(.*)", setting) for setting in settings)
    return [(match[2] or match[1]).replace("=", "") for match in found if match]
