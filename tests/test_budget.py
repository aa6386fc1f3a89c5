"""Each package stays within its budget of lines, `[tool.budget]` in pyproject.toml. A rise needs a reason."""

import re
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
BUDGET = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["budget"]
SOURCES = ("*.py", "*.js", "*.css", "*.html")
CONSTANT = re.compile(r"[A-Z][A-Z_0-9, ]*( *: *\w+)? *= *[-\d(]")


def files(package):
    return [path for pattern in SOURCES for path in (ROOT / package).rglob(pattern)]


@pytest.mark.parametrize("package", BUDGET["lines"])
def test_package_stays_within_its_lines(package):
    lines = sum(len(path.read_text(encoding="utf-8").splitlines()) for path in files(package))
    assert 0 < lines <= BUDGET["lines"][package]


def test_product_stays_within_its_files():
    product = [name for name in BUDGET["lines"] if name not in ("tests", "benchmarks")]
    assert sum(len(files(name)) for name in product) <= BUDGET["files"]


def test_models_stay_within_their_constants():
    """Numeric module constants; each has a unit, a meaning and a source."""
    lines = [
        line
        for name in BUDGET["models"]
        for path in (ROOT / name).rglob("*.py")
        for line in path.read_text(encoding="utf-8").splitlines()
    ]
    assert sum(bool(CONSTANT.match(line)) for line in lines) <= BUDGET["constants"]
