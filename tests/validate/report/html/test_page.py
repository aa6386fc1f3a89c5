"""report.html as a file: whole, self-contained, true to the summary; and in a browser: legible, and the scene turns."""

from __future__ import annotations

import base64
import json
import re
from collections.abc import Iterator
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest

from compare.analyses.why import Why
from compare.blame import Budget, Part, Split
from compare.options import Options
from compare.outcome import Outcome
from compare.report.table import Row, Section, Style, Table
from scenes.loading import load
from tests.browser import WITHOUT_WEBGL, Browser
from validate.report import output
from validate.report.figures import table
from validate.report.html.page import page
from validate.report.html.surface import Surface, packed, surface

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


def test_slopes_are_counted_apart(tmp_path: Path) -> None:
    """As in the headline, which counts the other checks alone."""
    verdicts = {"fig4": "differs", "eq13": "agrees", "slope_sink.width": "differs", "slope_sink.length": "agrees"}
    document = {
        "checks": [
            {"id": name, "verdict": verdict, "u_num": 0.0, "difference": 0.1} for name, verdict in verdicts.items()
        ]
    }
    said = " ".join(Reader(page(tmp_path, "a", "b", (), document, None)).text)
    assert re.search(r"1 differ\s+: fig4 ", said)
    assert re.search(r"1 agree\s+: eq13 ", said)
    assert "slopes by the scene's keys: 1 of 2 differ" in said


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The real run, steady and with figures: the folder."""
    folder = tmp_path_factory.mktemp("report") / "run"
    output.run(load("sink", ["accuracy=1e-2"]), Options(steady=True), folder)
    return folder


def test_the_page_is_whole_and_needs_no_other_file(run: Path) -> None:
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


def test_without_figures_it_is_small_and_says_what_was_not_declared(tmp_path: Path, no_solver: None) -> None:
    sink = replace(load("sink"), expected_to_differ=())
    outcome = output.run(sink, Options(figures=False), tmp_path / "run")
    text = (outcome.folder / "report.html").read_text(encoding="utf-8")
    assert "<script" not in text
    assert len(text) < 60_000
    said = " ".join(Reader(text).text)
    assert "peak rise" in said
    assert "not as expected" in said
    assert "the scene declares that it agrees" in said


def test_a_name_or_text_is_not_taken_for_markup(tmp_path: Path) -> None:
    document = {"warnings": ["5 < 6 & <b>bold</b>"], "scene": {"name": "<script>alert(1)</script>"}}
    told = Section("More", [Table(("<b>", "share"), [Row(["<b>", "1 K"], "agrees", "a < b")]), ["<b>"], "<b>"])
    text = page(tmp_path, "<i>", "a & b", [told], document, None)
    assert not re.search("<script|<b>", text)
    said = " ".join(Reader(text).text)
    assert "5 < 6 & <b>bold</b>" in said
    assert said.count("<b>") == 5
    assert "1 K" in said.replace("\xa0", " ")


def test_the_assumptions_to_blame_add_up_in_one_table(tmp_path: Path) -> None:
    parts = (Part("part 0", -1.0, 1e-3), Part("part 1", 0.25, 1e-3))
    splits = tuple(Split(name, "K", 10.0, -0.75, 2e-3, parts) for name in ("peak", "end"))
    budget = Budget("paper", splits, (), None, {}, "the anchor")
    found = Why().section(budget, Outcome(load("sink"), Options()), Style(page=True))
    text = page(tmp_path, "a", "b", [found], {}, None)
    Reader(text)
    assert "<h2>Why the paper&#x27;s model differs from 3D</h2>" in text
    assert text.count("part 0") == 1
    assert "-7.50 \N{PLUS-MINUS SIGN} 0.02" in text.replace("&nbsp;", " ")


CANVAS = "document.querySelector('canvas.scene')"
PLACE = f"(() => {{ const c = {CANVAS}; c.scrollIntoView({{block: 'center'}}); const r = c.getBoundingClientRect(); \
return [r.left + r.width / 2, r.top + r.height / 2]; }})()"


@pytest.fixture(scope="module")
def chromium() -> Iterator[Browser]:
    with Browser() as found:
        yield found


@pytest.mark.needs("browser")
@pytest.mark.parametrize("width", [380, 1400])
def test_legible_at_both_widths(run: Path, chromium: Browser, width: int) -> None:
    chromium.open(run / "report.html", width)
    assert chromium.errors == []
    # No sideways scrolling of the page, and no text smaller than a phone can show.
    assert chromium.run("document.documentElement.scrollWidth") == width
    right = "(image) => image.getBoundingClientRect().right"
    widest = f"Math.max(...[...document.querySelectorAll('figure img')].map({right}))"
    assert 0 < chromium.run(widest) <= width
    smallest = "Math.min(...[...document.querySelectorAll('td, dd, p, li, figcaption')].map((e) => parseFloat(getComputedStyle(e).fontSize)))"  # noqa: E501
    assert chromium.run(smallest) >= 13
    cut = "[...document.querySelectorAll('td, dd, p, h2')].filter((e) => e.offsetParent && e.getBoundingClientRect().right > innerWidth + 1).map((e) => e.textContent)"  # noqa: E501
    assert chromium.run(cut) == []


@pytest.mark.needs("browser")
def test_the_scene_shows_the_field_turns_and_nears(run: Path, chromium: Browser) -> None:
    """The middle of the beam, in the middle of the canvas, has the scale's last colour; a corner is empty."""
    chromium.open(run / "report.html", 1000)
    assert chromium.run("document.querySelector('.field').classList.contains('live')")
    pixel = (
        f"(() => {{ const c = {CANVAS}, t = document.createElement('canvas'); t.width = c.width; t.height = c.height;\
 const g = t.getContext('2d', {{willReadFrequently: true}}); g.drawImage(c, 0, 0);\
 return [0.5, 0.02].map((f) => [...g.getImageData(f * c.width, f * c.height, 1, 1).data].slice(0, 3)); }})()"
    )
    middle, corner = chromium.run(pixel)
    assert corner == [255, 255, 255]
    red, green, blue = middle
    assert (red > 200, green > 180, blue < 140) == (True, True, True)
    x, y = chromium.run(PLACE)
    picture = f"{CANVAS}.toDataURL()"
    first = chromium.run(picture)
    assert chromium.run(picture) == first
    chromium.drag((x, y), (x + 50, y + 30))
    turned = chromium.run(picture)
    assert turned != first
    chromium.wheel((x, y), -300)
    assert chromium.run(picture) != turned
    slider = "document.querySelector('.field input')"
    chromium.run(f"{slider}.value = 0; {slider}.dispatchEvent(new Event('input'))")
    assert chromium.run("document.querySelector('.field output').textContent") == "true proportions"
    assert chromium.errors == []


@pytest.mark.needs("browser")
def test_printed_it_shows_the_picture(run: Path, chromium: Browser) -> None:
    chromium.open(run / "report.html", 1000)
    chromium.say("Emulation.setEmulatedMedia", media="print")
    shown = "['canvas.scene', '.picture'].map((q) => document.querySelector(q).offsetHeight > 50)"
    assert chromium.run(shown) == [False, True]
    chromium.say("Emulation.setEmulatedMedia", media="screen")
    assert chromium.run(shown) == [True, False]
    assert chromium.pdf().startswith(b"%PDF")


@pytest.mark.long
@pytest.mark.needs("browser")
def test_without_webgl_the_picture_stays(run: Path) -> None:
    with Browser(*WITHOUT_WEBGL) as plain:
        plain.open(run / "report.html", 1000)
        assert plain.errors == []
        assert plain.run("document.querySelector('.picture').offsetHeight") > 50
        assert plain.run(f"{CANVAS}.offsetHeight") == 0


def bricks(*boxes: tuple[tuple[float, float], ...], cuts: int) -> tuple[np.ndarray, np.ndarray]:
    """Boxes cut into cubes, their points not shared between boxes."""
    corners = ((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1))
    numbers = np.arange((cuts + 1) ** 3).reshape(3 * (cuts + 1,))
    one = np.stack([numbers[i : i + cuts, j : j + cuts, k : k + cuts].ravel() for i, j, k in corners], axis=1)
    grids = [np.meshgrid(*(np.linspace(*side, cuts + 1) for side in box), indexing="ij") for box in boxes]
    points = [np.stack(grid, axis=-1).reshape(-1, 3) for grid in grids]
    return np.concatenate(points), np.concatenate([one + n * numbers.size for n in range(len(boxes))])


def area(found: Surface) -> float:
    sides = np.sort(np.ptp(found.points[found.faces], axis=1), axis=1)
    return float((sides[:, 1] * sides[:, 2]).sum())


BEAM, PAD = ((0.0, 1.0), (0.0, 4.0), (0.0, 0.5)), ((0.0, 1.0), (4.0, 6.0), (0.0, 0.5))


@pytest.mark.parametrize("most", [10_000, 100, 20])
def test_shape_and_values_are_exact(most: int) -> None:
    """Two boxes that touch: their common face is inside. Area of the whole: 2 (1 x 6 + 1 x 0.5 + 6 x 0.5)."""
    points, hexes = bricks(BEAM, PAD, cuts=8)

    def value(p: np.ndarray) -> np.ndarray:
        return np.sin(p[:, 1]) + p[:, 0] + 2 * p[:, 2]

    found = surface(points, hexes, value(points), most)
    assert area(found) == pytest.approx(19.0, rel=1e-12)
    assert found.values == pytest.approx(value(found.points), abs=1e-12)
    assert found.values.max() == value(points).max()
    assert len(found.points) <= max(most, 40)


def test_a_shape_that_is_not_closed_has_another_area() -> None:
    points, hexes = bricks(BEAM, PAD, cuts=8)
    inside = 4 * 64 + 4 * 8 + 4
    assert area(surface(points, np.delete(hexes, inside, axis=0), points[:, 0])) != pytest.approx(19.0, rel=1e-6)


@pytest.mark.long
def test_edges_are_where_the_surface_bends() -> None:
    points, hexes = bricks(BEAM, cuts=4)
    found = surface(points, hexes, points[:, 0])
    ends = found.points[found.edges]
    assert np.linalg.norm(ends[:, 0] - ends[:, 1], axis=1).sum() == pytest.approx(4 * (1.0 + 4.0 + 0.5))


@pytest.mark.long
def test_packed_is_what_the_script_reads() -> None:
    points, hexes = bricks(BEAM, cuts=4)
    found = surface(points, hexes, points[:, 1])
    data = json.loads(packed(found, table(), 20.0))
    places = np.frombuffer(base64.b64decode(data["places"]), "<u2").reshape(-1, 3)
    values = np.frombuffer(base64.b64decode(data["values"]), "<u2")
    assert places / 65535 * np.array(data["size"]) * 1e-6 == pytest.approx(found.points, abs=1e-4)
    assert values / 65535 * 4.0 == pytest.approx(found.values, abs=1e-4)
    triangles = np.frombuffer(base64.b64decode(data["triangles"]), "<u4")
    assert (triangles.max(), len(triangles)) == (len(found.points) - 1, 6 * len(found.faces))
    assert len(base64.b64decode(data["colours"])) == 768
