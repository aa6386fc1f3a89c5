"""report.html: whole, self-contained and true to the summary."""

import json
import re
from dataclasses import replace
from html.parser import HTMLParser

import pytest

from compare.analyses.why import Why
from compare.blame import Budget, Estimate, Part, Split
from compare.options import Options
from compare.outcome import Outcome
from compare.report import Row, Section, Style, Table
from scenes.loading import load
from validate.report import output
from validate.report.page import page
from validate.report.text import table_text

VOID = {"meta", "link", "img", "input", "br"}


class Reader(HTMLParser):
    """Collects text, headings and links, and fails where tags don't close in order."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.open, self.links, self.text = list[str](), list[str](), list[str]()
        self.feed(text)
        self.close()
        assert self.open == []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.links += [str(value) for name, value in attrs if name in ("src", "href")]
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        if self.open and self.open[-1] not in ("script", "style"):
            self.text.append(data)


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """The real run, steady and with figures: the folder."""
    folder = tmp_path_factory.mktemp("report") / "run"
    output.run(load("sink", ["accuracy=1e-2"]), Options(steady=True), folder)
    return folder


def test_the_page_is_whole_and_needs_no_other_file(run):
    text = (run / "report.html").read_text(encoding="utf-8")
    found = Reader(text)
    outside = [link for link in found.links if not link.startswith(("data:", "#"))]
    summary = json.loads((run / "summary.json").read_text(encoding="utf-8"))
    assert set(outside) == set(summary["files"]) - {"report.html"}
    assert not re.search(r"https?://", text.replace("http://www.w3.org", ""))
    said = " ".join(found.text)
    assert said.index("The paper's 1D model is 6.6") < said.index("checks differ") < said.index("eq12")
    assert '<th>of</th><th class="n">1D</th><th class="n">3D</th><th class="n">difference</th><th>relative to' in text
    assert not {"predicted", "measured"} & set(found.text)
    for check in summary["checks"]:
        assert check["id"] in said
    for title in ("Field", "Figures", "Error budget", "Energy balance", "Mesh", "Plan", "Scene", "Versions and files"):
        assert f"<h2>{title}</h2>" in text
    assert "not asked for (--fields)" in said
    assert text.count("data:image/svg+xml") == 1
    assert len(text) < 2_000_000


def test_without_figures_it_is_small_and_says_what_was_not_declared(tmp_path, no_solver):
    sink = replace(load("sink"), expected_to_differ=())
    outcome = output.run(sink, Options(figures=False), tmp_path / "run")
    text = (outcome.folder / "report.html").read_text(encoding="utf-8")
    assert "<script" not in text
    assert len(text) < 60_000
    said = " ".join(Reader(text).text)
    assert "peak rise" in said
    assert "not as expected" in said
    assert "the scene declares that it agrees" in said


def test_a_name_or_text_is_not_taken_for_markup(tmp_path):
    document = {
        "warnings": ["5 < 6 & <b>bold</b>"],
        "scene": {"scene": {"name": "<script>alert(1)</script>"}, "box": []},
    }
    told = Section("More", [Table(("<b>", "share"), [Row(["<b>", "1 K"], "agrees", "a < b")]), ["<b>"], "<b>"])
    text = page(tmp_path, "<i>", "a & b", [told], document)
    assert not re.search("<script|<b>", text)
    said = " ".join(Reader(text).text)
    assert "5 < 6 & <b>bold</b>" in said
    assert said.count("<b>") == 5
    assert "1 K" in said.replace("\xa0", " ")


def test_errors_are_relative_to_rises_and_no_balance_is_stated_of_a_state_not_solved(tmp_path):
    fem3d = {"units": {"tip": "K"}, "energy_imbalance": 1e-3}
    scene = {"scene": {"initial_temperature": 300.0}, "box": []}
    steady = fem3d | {"steady": {"tip": {"value": 400.0, "error": 2.0}}}
    ranges = {"tip": {"least": 260.0, "largest": 320.0}}
    transient = fem3d | {"steady": {}, "transient": {"errors": {"tip": 2.0}, "range": ranges, "imbalance": 1e-3}}
    for document, part, states in ((steady, "2.0&nbsp;%", True), (transient, "5.0&nbsp;%", False)):
        text = page(tmp_path, "a", "b", [], {"scene": scene, "fem3d": document})
        assert part in text
        assert ("imbalance of the steady state" in text) is states


def test_figures_of_sweeps_have_captions(tmp_path):
    for name in ("figure_map.svg", "figure_lines.svg"):
        (tmp_path / name).write_text("<svg/>", encoding="utf-8")
        text = page(tmp_path, "a", "b", [], {"files": [name]})
        assert "over" in text.split("<figcaption>")[1].split("</figcaption>")[0]


def test_a_name_that_a_reader_may_type_is_whole():
    name = "boundary.upper right clamp.contact_resistance"
    lines = table_text(Table(("key", "a", "b"), [[name, "1" * 20, "2" * 20], ["w", "3", "4"]]), Style()).splitlines()
    assert lines[1].strip() == name
    assert lines[2].split() == ["1" * 20, "2" * 20]
    assert max(map(len, lines)) <= 80


def test_the_assumptions_to_blame_add_up_in_one_table(tmp_path):
    parts = (Part("part 0", -1.0, 1e-3), Part("part 1", 0.25, 1e-3))
    splits = tuple(Split(name, "K", 10.0, Estimate(-0.75, 2e-3), parts) for name in ("peak", "end"))
    budget = Budget("paper", splits, (), "the anchor")
    found = Why().section(budget, Outcome(load("sink"), Options()), Style(page=True))
    text = page(tmp_path, "a", "b", [found], {})
    Reader(text)
    assert "<h2>Why the paper&#x27;s model differs from 3D</h2>" in text
    assert text.count("part 0") == 1
    assert "-7.50 \N{PLUS-MINUS SIGN} 0.02" in text.replace("&nbsp;", " ")
