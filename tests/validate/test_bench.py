"""`validate bench`: the page of its measurements."""

import pytest

from benchmarks import bench
from validate.cli import main

WHOLE = {
    "tool": "this toolkit", "label": "accuracy 1e-03", "failure": "", "median_s": 2.0, "fastest_s": 1.0,
    "slowest_s": 3.0, "unknowns": 10, "error": 5e-4, "bound": 9e-4,
}  # fmt: skip
ROWS = [
    WHOLE, {**WHOLE, "tool": "scikit-fem", "label": "cells", "median_s": 1.0, "bound": None},
    {"tool": "scikit-fem", "label": "degree 2", "failure": "took too long " * 9},
]  # fmt: skip
WORK = {"made_by": "one", "rows": ROWS}
SKIP = {"name": "figures", "first_s": 0.5, "second_s": 2.0, "ratio": 0.25, "least": 0.2, "most": 0.3}


@pytest.mark.long
def test_a_page_is_made_of_measurements(tmp_path, capsys, monkeypatch):
    numbers = {"quick": False, "machine": {"numpy": "2"}, "skips": [SKIP], "steady": WORK}
    monkeypatch.setattr(bench, "run", lambda *_: numbers)
    written = tmp_path / "page.md"
    assert main(["bench", "--part", "skips", "--markdown", str(written)]) == 0
    text = written.read_text(encoding="utf-8")
    assert "| 1 % | 2 | 1 |" in text
    assert "| 0.01 % | - | - |" in text
    assert "| figures | 0.5 | 2 | 0.25 | 0.2 | 0.3 |" in text
    assert "figures/benchmark-steady.png" in text
    assert (tmp_path / "figures" / "benchmark-steady.png").stat().st_size > 10_000
    printed = capsys.readouterr().out
    assert max(map(len, printed.splitlines()[:-1])) <= 80
    assert printed.splitlines()[-1] == f"Wrote {written}, {tmp_path / 'figures' / 'benchmark-steady.png'}"
