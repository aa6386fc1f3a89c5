"""`validate bench`: refused input, and the page of numbers measured before."""

import json
from pathlib import Path

import pytest

from validate.cli import main

WHOLE = {
    "tool": "this toolkit", "label": "accuracy 1e-03", "failure": "", "median_s": 2.0, "fastest_s": 1.0,
    "slowest_s": 3.0, "solves": 3, "start_up_s": 0.5, "peak_MB": 100.0, "unknowns": 10, "error": 5e-4, "bound": 9e-4,
}  # fmt: skip
ROWS = [
    WHOLE, {**WHOLE, "tool": "NGSolve", "label": "degree 3", "median_s": 1.0, "bound": None},
    {"tool": "scikit-fem", "label": "degree 2", "failure": "took too long " * 9},
]  # fmt: skip
WORK = {"made_by": "one", "checked_by": "two", "uncertainty": 1e-6, "rows": ROWS}
SKIP = {"name": "figures", "first_s": 0.5, "second_s": 2.0, "ratio": 0.25, "least": 0.2, "most": 0.3}


@pytest.mark.parametrize(
    ("text", "sentence"),
    [("[1]", "no file of numbers"), ('{"schema": 1, "machine": {}}', "another version's form")],
)
def test_a_file_of_something_else_is_refused(text, sentence, capsys):
    Path("other.json").write_text(text, encoding="utf-8")
    assert main(["bench", "--from", "other.json"]) == 2
    assert sentence in capsys.readouterr().err


@pytest.mark.long
def test_a_page_is_made_of_numbers_measured_before(tmp_path, capsys):
    numbers = {"schema": 4, "quick": False, "machine": {"ngsolve": "none"}, "skips": [SKIP], "steady": WORK}
    (tmp_path / "found.json").write_text(json.dumps(numbers), encoding="utf-8")
    written = tmp_path / "page.md"
    given = ["--from", str(tmp_path / "found.json"), "--part", "skips", "--markdown", str(written)]
    assert main(["bench", *given]) == 0
    text = written.read_text(encoding="utf-8")
    assert "| 1 % | 2 | - | 1 |" in text
    assert "| 0.01 % | - | - | - |" in text
    assert "| figures | 0.5 | 2 | 4.00 |" in text
    assert "figures/benchmark-steady.png" in text
    assert (tmp_path / "figures" / "benchmark-steady.png").stat().st_size > 10_000
    printed = capsys.readouterr().out
    assert max(map(len, printed.splitlines()[:-1])) <= 80
    assert printed.splitlines()[-1] == f"Wrote {written}, {tmp_path / 'figures' / 'benchmark-steady.png'}"
