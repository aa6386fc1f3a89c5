"""The parts of the bench, each as plain numbers for a page or a file; where and with what they were taken."""

from __future__ import annotations

import platform
import re
import shutil
import subprocess
from collections.abc import Callable, Mapping, Sequence
from importlib import metadata
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from validate.bench import device, growth, skips, start_up, work
from validate.bench.entries import FREEFEM, NGSOLVE
from validate.processes import processors

PARTS = ("transient", "steady", "device", "growth", "skips", "start-up")
SCHEMA = 2


def run(
    parts: Sequence[str], count: int, quick: bool, progress: Callable[[str], None], earlier: Mapping[str, Any]
) -> dict[str, Any]:
    """The parts asked for, in the order of PARTS, ``count`` rounds each, and those that ``earlier`` has.

    Raises ArithmeticError where a reference cannot be made; an entry that fails is a row that says so."""
    there = {NGSOLVE: find_spec("ngsolve") is not None, FREEFEM: shutil.which("FreeFem++") is not None}
    installed = frozenset(tool for tool in there if there[tool])
    jobs: dict[str, Callable[[], Any]] = {
        "transient": lambda: work.work_precision(True, count, quick, installed, progress),
        "steady": lambda: work.work_precision(False, count, quick, installed, progress),
        "device": lambda: device.run(quick, count, progress),
        "growth": lambda: growth.run(quick, 1 if quick else min(count, 2), installed, progress),
        "skips": lambda: skips.run(quick, count, progress),
        "start-up": lambda: start_up.run(count, progress),
    }
    found: dict[str, Any] = {"schema": SCHEMA, "quick": quick, "machine": _machine(), **earlier}
    return found | {part: jobs[part]() for part in PARTS if part in parts and part not in found}


def _machine() -> dict[str, str]:
    """The kind of machine (no names), system, versions and threads."""
    info = Path("/proc/cpuinfo")
    listed = info.read_text(encoding="utf-8") if info.exists() else ""
    named = re.search(r"^model name\s*: (.+)$", listed, re.MULTILINE)
    processor = named[1].strip() if named else platform.processor() or platform.machine()
    found = {
        "processor": f"{processor}, {processors()} cores to use", "system": f"{platform.system()} {platform.machine()}",
        "threads": "1 in every program", "Python": platform.python_version(),
    }  # fmt: skip
    for package in ("numpy", "scipy", "scikit-fem", "ngsolve"):
        try:
            found[package] = metadata.version(package)
        except metadata.PackageNotFoundError:
            found[package] = "not installed"
    if shutil.which("FreeFem++") is None:
        return found | {FREEFEM: "not installed"}
    done = subprocess.run(["FreeFem++"], capture_output=True, text=True, check=False, timeout=30)
    version = re.search(r"version\s+([\d.]+)", done.stdout + done.stderr)
    return found | {FREEFEM: version[1] if version else "unknown"}
