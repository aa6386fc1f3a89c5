"""Verdicts, the table in its three forms, and the command."""

import json
import math

import pytest

from validate.cli import main
from validate.report.table import Style
from validate.verify import cases, report
from validate.verify.report import Row, observed_order, order_row, skipped

GOOD = Row("exact", "slab", "middle", "K", 300.0, 300.001, 0.002, 0.01)
FAR = Row("exact", "slab", "mean", "K", 300.0, 300.003, 0.002, 0.01, "a source")
VAGUE = Row("exact", "bar", "mean", "K", 300.0, 300.001, 0.02, 0.01)
ROWS = [order_row("order in space", "bricks", "rise, L2", 3, 2.95), GOOD, FAR, VAGUE, skipped("second code", "x", "no")]


def test_a_row_agrees_within_its_error_if_that_is_small_enough():
    assert [row.verdict for row in ROWS] == ["agrees", "agrees", "differs", "unresolved", "skipped"]
    assert order_row("", "", "", 3, 2.89).verdict == "differs"
    assert Row("", "", "", "", 1.0, math.nan, 1.0).verdict == "differs"


def test_orders_are_those_of_powers():
    assert observed_order([0.5**3, 0.25**3], 2.0) == pytest.approx(3)
    assert math.isnan(observed_order([1.0, 0.0], 2.0))


def test_the_table_says_what_differs_and_why():
    text = report.text(ROWS, Style())
    assert text.startswith("2 of 4 rows agree, 1 differ, 1 unresolved, 1 skipped.")
    assert "differs: a source" in text
    assert "exceeds 1.0e-02" in text
    assert max(map(len, text.splitlines())) <= 80
    page = report.markdown(ROWS, {"numpy": "1"})
    assert page.count("\n| slab |") == 2
    found = json.loads(json.dumps(report.document(ROWS, {}, 1.0), allow_nan=False))
    assert found["counts"]["differs"] == 1
    assert found["rows"][1]["difference"] == pytest.approx(0.001)


def broken():
    yield GOOD
    raise ArithmeticError("no luck")


@pytest.mark.parametrize(("rows", "status"), [([GOOD], 0), ([GOOD, FAR], 1), (broken(), 1)])
def test_the_exit_status_follows_the_verdicts_and_a_case_that_fails_is_a_row(
    rows, status, monkeypatch, capsys, tmp_path
):
    monkeypatch.setattr(cases, "CASES", (cases.Case("exact", "one", lambda: iter(rows)),))
    page = tmp_path / "page.md"
    assert main(["verify", "--jobs", "1", "--json", "--markdown", str(page)]) == status
    out = capsys.readouterr().out
    assert json.loads(out[out.index("{") :])["counts"]["agrees"] == 1
    assert page.read_text().startswith("# Code verification")
    assert ("ended with ArithmeticError: no luck" in out) == (not isinstance(rows, list))


@pytest.mark.parametrize("wrong", [["--jobs", "0"], ["--jobs", "two"], ["--only", "all"]])
def test_bad_input_is_one_sentence(wrong, capsys):
    assert main(["verify", *wrong]) == 2
    assert len(capsys.readouterr().err.splitlines()) == 1
