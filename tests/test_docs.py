"""The documentation: every page is in the contents, and its references exist. CI builds it in strict mode."""

import pkgutil
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PAGES = sorted((ROOT / "docs").rglob("*.md"))
COPY = re.compile(r'shutil\.copy\(ROOT / "(\S+)" / "(\S+)", ROOT / "docs" / "(\S+)" / "(\S+)"\)')
# The pages that building them copies from elsewhere, by where they come to lie.
COPIED = {
    ROOT / "docs" / folder / name: ROOT / source / of
    for source, of, folder, name in COPY.findall((ROOT / "docs" / "conf.py").read_text(encoding="utf-8"))
}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT / "docs")))
def test_what_a_page_refers_to_exists(page):
    text = page.read_text(encoding="utf-8")
    linked = re.findall(r"\]\(([^)#:]+?)(?:#[^)]*)?\)", text)
    included = re.findall(r"\{(?:literalinclude|include|image)\} (\S+)", text)
    run = [word.split(":")[0] for line in re.findall(r"\{command\} (.+)", text) for word in line.split() if "/" in word]
    paths = {link: page.parent / link for link in (*linked, *included)}
    assert [link for link, path in paths.items() if not COPIED.get(path, path).exists()] == []
    assert [name for name in run if not (ROOT / name).exists()] == []


def test_every_page_is_in_the_contents():
    index = (ROOT / "docs" / "index.md").read_text(encoding="utf-8")
    listed = {
        line.strip() for block in re.findall(r"```\{toctree\}(.*?)```", index, re.DOTALL) for line in block.splitlines()
    }
    names = {str(page.relative_to(ROOT / "docs").with_suffix("")) for page in PAGES} - {"index"}
    assert names - listed == set()


def test_the_scene_to_add_is_one(tmp_path):
    from scenes.loading import load_free as load

    found = re.search(r"```toml\n(.*?)```", (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8"), re.DOTALL)
    (tmp_path / "beam.toml").write_text(found.group(1), encoding="utf-8")
    assert [probe.name for probe in load(str(tmp_path / "beam.toml"), []).probes] == ["tip"]


def test_the_places_to_add_to_are_the_true_ones():
    """Each name in backquotes is in the file named after it."""
    text = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
    named = re.findall(r"`(\w+)`(?: or `(\w+)`)?(?: there)?,? (?:in|of)\s+`([\w/]+\.py)`", text)
    assert len(named) >= 5
    for *names, file in named:
        code = (ROOT / file).read_text(encoding="utf-8")
        assert [name for name in names if name and not re.search(rf"^(def |class )?{name}\b", code, re.MULTILINE)] == []


def test_the_walk_to_a_verdict_is_there():
    """At most 15 steps, each of whose names is one."""
    text = (ROOT / "ARCHITECTURE.md").read_text(encoding="utf-8")
    walk = text.split("## From")[1].split("\n\n", 1)[1].split("## ")[0]
    assert 10 <= len(re.findall(r"^\d+\. ", walk, re.MULTILINE)) <= 15
    rooms = {"cli": "validate.cli", "report": "validate.report", "verdict": "compare.verdict"}
    named = [name.split(".") for name in re.findall(r"`([a-z]\w*(?:\.\w+)+)`", walk) if not name.endswith(".json")]
    assert len(named) > 15
    for first, *rest in named:
        pkgutil.resolve_name(".".join([rooms.get(first, first), *rest]))


def test_every_command_is_on_its_page():
    from validate.cli.arguments import COMMANDS

    page = (ROOT / "docs" / "commands.md").read_text(encoding="utf-8")
    assert [name for name in COMMANDS if f"validate {name} --help" not in page] == []


@pytest.mark.parametrize("page", ["README.md", "docs/index.md", "docs/theory/fem3d.md"])
def test_how_often_the_stated_errors_hold_is_what_the_stress_page_says(page):
    """Of random scenes of every kind, steady and over time."""
    lines = (ROOT / "docs" / "stress.md").read_text(encoding="utf-8").splitlines()
    rows = "".join(line for line in lines if "honoured by a finer solve" in line)
    of = sum(int(count) for count in re.findall(r"(\d+) of \d+ scenes", rows))
    broken = sum(int(count) for count in re.findall(r"violated by (\d+) of", rows))
    said = " ".join((ROOT / page).read_text(encoding="utf-8").split())
    numbers = [(of - int(held), int(count)) for held, count in re.findall(r"held in (\d+) of (\d+)", said)]
    assert numbers
    assert set(numbers) == {(broken, of)}
    assert "stress.md" in said
