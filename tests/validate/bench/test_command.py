"""`validate bench`: what it refuses, and the page of numbers measured before."""

import json
from pathlib import Path

import pytest

from validate.bench import page, work
from validate.cli import main

MACHINE = {"processor": "one", "ngsolve": "not installed"}


WHOLE = {
    "tool": "this toolkit, whole run", "label": "accuracy 1e-03", "failure": "", "median_s": 2.0, "fastest_s": 1.0,
    "slowest_s": 3.0, "solves": 3, "start_up_s": 0.5, "peak_MB": 100.0, "unknowns": 10, "steps": 0, "error": 5e-4,
    "errors": {}, "claimed": 9e-4,
}  # fmt: skip
ROWS = [
    WHOLE, {**WHOLE, "tool": "this toolkit, mesh given", "label": "degree 3", "median_s": 0.5, "claimed": None},
    {**WHOLE, "tool": "NGSolve", "label": "order 3", "median_s": 1.0, "claimed": None},
]  # fmt: skip
REFERENCE = {"made_by": "one", "checked_by": "two", "uncertainty": 1e-6}
WORK = {"reference": REFERENCE, "rows": ROWS, "targets": work.targets(ROWS)}


@pytest.mark.parametrize(
    ("text", "sentence"),
    [("[1]", "no file of numbers"), ('{"schema": 1, "machine": {}}', "another version's form")],
)
def test_what_is_no_file_of_this_benchmark(text, sentence, capsys):
    Path("other.json").write_text(text, encoding="utf-8")
    assert main(["bench", "--from", "other.json"]) == 2
    assert sentence in capsys.readouterr().err


@pytest.mark.long
def test_a_page_is_made_of_numbers_measured_before(tmp_path, capsys):
    skips = [{"skip": "symmetry", "failure": "", "on_s": 0.5, "off_s": 2.0}]
    numbers = {"schema": 2, "quick": False, "machine": MACHINE, "skips": skips, "steady": WORK}
    (tmp_path / "found.json").write_text(json.dumps(numbers), encoding="utf-8")
    written = tmp_path / "page.md"
    given = ["--from", str(tmp_path / "found.json"), "--part", "skips", "--markdown", str(written)]
    assert main(["bench", *given]) == 0
    text = written.read_text(encoding="utf-8")
    assert (
        "| 1 % | 2 s | 0.5 s | 1 s; **ahead: 2.0 times as fast as our whole run**; "
        "2.0 times as long as our solve on a given mesh |"
    ) in text
    assert "| symmetry | 0.5 | 2 | 4.00 |" in text
    assert "Not installed here, so not compared: NGSolve." in text
    assert "figures/benchmark-steady.png" in text
    assert (tmp_path / "figures" / "benchmark-steady.png").stat().st_size > 10_000
    said = capsys.readouterr().out
    assert "|" not in said
    assert max(map(len, said.splitlines()[:-1])) <= 80
    shown = [line.split() for line in said.splitlines()]
    assert ["whole", "run", "mesh", "given", "NGSolve"] in shown
    assert ["1", "%", "2", "0.5", "1"] in shown
    assert ["0.01", "%", "-", "-", "-"] in shown
    assert ["symmetry", "0.5", "2", "4.00"] in shown
    assert said.splitlines()[-1] == f"Wrote {written}, {tmp_path / 'figures' / 'benchmark-steady.png'}"
    # Without a page the plots go to the results.
    assert main(["bench", *given[:-2]]) == 0
    assert "Wrote results/bench/benchmark-steady.png" in capsys.readouterr().out


def test_a_long_name_does_not_make_a_table_wider_than_the_terminal():
    skips = [
        {"skip": "symmetry " * 20, "failure": "", "on_s": 0.5, "off_s": 2.0},
        {"skip": "broken", "failure": "took too long " * 9},
    ]
    said = page.text({"skips": skips})
    assert max(map(len, said.splitlines())) <= 80
    assert " ".join(said.split()).count("took too long") == 9
