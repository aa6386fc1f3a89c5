"""The folder of one run's results, and of an exported model."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

from compare.options import safe_folder, setting_words
from validate.folder import Content, Folder

PICTURE = "scene.png"
"""The picture of a scene that is not solved yet."""
SCHEMA = 1
"""The version of summary.json."""

RUN = Content(
    "a run of this program", "output", "--out",
    re.compile(
        r"scene\.png|summary\.json|(traces|sensitivities)\.csv|(figure\w+|islands|islands_runs|left_out|why|sensitivity"
        r"|shielding|validation)\.(png|svg)|fem3d\.(pvd|vtkhdf)|fem3d_\w+\.vtu|report\.html"
    ),
    "summary.json", ("schema", "plan"), (PICTURE,),
)  # fmt: skip

MODEL = Content(
    "a model of this program", "export", "--export",
    re.compile(r"model\.(json|cir|py|fmu)|controllers\.(py|fmu)|__pycache__"), "model.json", ("scene", "matrices"),
)  # fmt: skip


def replaced(folder: Folder) -> str:
    """Return a sentence on the replaced run and its files that the new run lacks; empty without a replaced run."""
    earlier, names = folder.replaced
    if not earlier:
        return ""
    command = earlier.get("command")
    same = command == RUN.of(folder.target).get("command")
    which = "of the same command" if same else "there" + f" ({command})" * bool(command)
    gone = {_kind(name) for name in names} - {_kind(name) for name in RUN.among(folder.target)}
    return f"the earlier run {which}" + (f", gone with it: {', '.join(sorted(gone))}" if gone else "")


def _kind(name: str) -> str:
    """Return the group of a file: a figure in two formats, the fields."""
    if name.startswith("fem3d"):
        return "fields"
    return name.partition(".")[0] if name.endswith((".png", ".svg")) else name


def folder_of_sweep(scene: str, kind: str, settings: Sequence[str], *words: str) -> Path:
    """ "results/sink-sweep-width10um-200um-20-steady": the varied and the overridden keys, then other options."""
    return safe_folder(f"{scene}-{kind}", *setting_words([re.sub("[:,]", "-", text) for text in settings]), *words)
