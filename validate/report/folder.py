"""The folder of one run's results: what is in it, and its usual name.

The name tells apart everything that makes results different: the scene with each of its keys that is not as usual, and
each option that changes a number, leaves out a part or adds one. ``--no-figures`` is none of these.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from scenes.loading import distinguishes, shortened
from scenes.plan import Request
from scenes.units import POWER, TIME, VOLTAGE
from validate.folder import Content, Folder

PICTURE = "scene.png"
"""The picture of a scene that is not solved yet."""
SCHEMA = 1
"""The version of summary.json."""

RUN = Content(
    "a run of this program", "output", "--out",
    re.compile(
        r"scene\.png|summary\.json|(traces|sensitivities)\.csv|(figure\w+|islands|islands_runs|left_out|why|sensitivity"
        r"|shielding|validation)\.(png|svg)|fem3d\.(pvd|vtkhdf(\.part)?)|fem3d_\w+\.vtu|report\.html"
    ),
    "summary.json", ("schema", "plan"), (PICTURE,),
)  # fmt: skip

MODEL = Content(
    "a model of this program", "export", "--export",
    re.compile(r"model\.(json|cir|py|fmu)|controllers\.(py|fmu)|__pycache__"), "model.json", ("scene", "matrices"),
)  # fmt: skip


def replaced(folder: Folder) -> str:
    """Which run has been replaced, and what of it the new one does not have; empty where there was none."""
    earlier, names = folder.replaced
    if not earlier:
        return ""
    command = earlier.get("command")
    same = command == RUN.of(folder.target).get("command")
    which = "of the same command" if same else "there" + f" ({command})" * bool(command)
    gone = {_kind(name) for name in names} - {_kind(name) for name in RUN.among(folder.target)}
    return f"the earlier run {which}" + (f", gone with it: {', '.join(sorted(gone))}" if gone else "")


def _kind(name: str) -> str:
    """What a file is one of several of: a figure in two formats, the fields."""
    if name.startswith("fem3d"):
        return "fields"
    return name.partition(".")[0] if name.endswith((".png", ".svg")) else name


def folder_of(scene: Any, request: Request, settings: Sequence[str] = (), data: Sequence[str] = ()) -> Path:
    """The folder of a run, "results/sink-2V-width20um-steady", "results/device-273K-paper-figure9" or
    "results/bridge-left-electrode.voltage2"; ``settings`` are overrides, ``data`` a file with its options."""
    options = ["sensitivities"] * request.sensitivities
    options += [] if request.uncertain is None else ["uncertain", *request.uncertain.given]
    fields = ["fields"] * request.fields
    held = [*request.data_uncertainty, *["calibrate"] * bool(request.calibrate), *request.calibrate]
    against = ["against", data[0].replace("..", "up"), *data[1:]] if data else []
    model = ["model", getattr(request.model, "__name__", str(request.model).replace(":", "-"))] if request.model else []
    if scene.kind == "free":
        return _safe(scene.name, *_words(settings), *model, *["why"] * request.why, *options, *held, *fields, *against)
    if scene.kind == "sink":
        words = [request.reduction.replace(":", "")] * (request.reduction != "paper")
        words += ["3d"] * (request.models == ("fem3d",)) + ["1d"] * (request.models == ("reduced1d",))
        words += ["steady"] * (not request.transient) + ["why"] * request.why
        words += ["left-out"] * request.left_out
        words += [*options, *held]
        words += [f"monte-carlo-{request.monte_carlo}"] * (request.monte_carlo > 0)
        words += [*fields, *(TIME.show(time).replace(" ", "") for time in request.field_times)]
        words += against
    else:
        words = ["3d"] * request.in_3d + ["paper"] * (request.scheme == "paper")
        words += [*request.about, request.meter or "", *["left-out"] * request.left_out, *options]
        limits = (request.largest_voltage, VOLTAGE), (request.largest_power, POWER)
        words += [f"max{known.show(limit)}".replace(" ", "") for limit, known in limits if limit < float("inf")]
    # Overrides of what the checks are held to, which the scene's own text leaves out.
    matches = (re.match(r"\s*(?:checks\.)?(tolerances|expect_differs)\b\.?(.*)", setting) for setting in settings)
    of_checks = [(match[2] or match[1]).replace("=", "") for match in matches if match]
    return _safe(scene.name, distinguishes(scene), *words, *of_checks)


def folder_of_sweep(scene: str, kind: str, settings: Sequence[str], *words: str) -> Path:
    """ "results/sink-sweep-width10um-200um-20-steady": what varies and what is overridden, then other options."""
    return _safe(f"{scene}-{kind}", *_words([re.sub("[:,]", "-", text) for text in settings]), *words)


def _words(settings: Sequence[str]) -> list[str]:
    words = []
    for setting in settings:
        key, _, value = setting.partition("=")
        value = "" if value.strip() == "true" else value.strip()  # "results/hotplate-steady"
        words.append((key.strip().partition(".")[2] or key) + re.sub("^-", "minus", value))
    return words


def _safe(name: str, *words: str) -> Path:
    safe = [re.sub(r"[^\w.+-]", "", re.sub(r"[\s/\\]+", "-", word.strip())).strip("-.") for word in words]
    return Path("results") / "-".join(filter(None, (name, shortened("-".join(filter(None, safe))))))
