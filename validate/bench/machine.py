"""Where and with what the times were taken: the kind of machine (no names), versions, threads."""

from __future__ import annotations

import platform
import re
import shutil
import subprocess
from importlib import metadata
from importlib.util import find_spec
from pathlib import Path

from validate.bench.entries import FREEFEM, NGSOLVE
from validate.processes import processors

PACKAGES = ("numpy", "scipy", "scikit-fem", "ngsolve")


def installed() -> frozenset[str]:
    """Which of the optional tools are there."""
    found = {NGSOLVE: find_spec("ngsolve") is not None, FREEFEM: shutil.which("FreeFem++") is not None}
    return frozenset(tool for tool, there in found.items() if there)


def describe() -> dict[str, str]:
    """Processor, system, versions and threads."""
    found = {
        "processor": f"{_processor()}, {processors()} cores to use",
        "system": f"{platform.system()} {platform.machine()}",
        "threads": "1 in every program",
        "Python": platform.python_version(),
    }
    for package in PACKAGES:
        try:
            found[package] = metadata.version(package)
        except metadata.PackageNotFoundError:
            found[package] = "not installed"
    found[FREEFEM] = _freefem()
    return found


def _processor() -> str:
    info = Path("/proc/cpuinfo")
    named = (
        re.search(r"^model name\s*: (.+)$", info.read_text(encoding="utf-8"), re.MULTILINE) if info.exists() else None
    )
    return named[1].strip() if named else platform.processor() or platform.machine()


def _freefem() -> str:
    if FREEFEM not in installed():
        return "not installed"
    done = subprocess.run(["FreeFem++"], capture_output=True, text=True, check=False, timeout=30)
    named = re.search(r"version\s+([\d.]+)", done.stdout + done.stderr)
    return named[1] if named else "unknown"
