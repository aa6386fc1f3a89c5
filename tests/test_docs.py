"""The documentation: every page is in the contents, its references exist, and the commands that it prints are planned
by --dry-run, or run where they are quick. CI builds it in strict mode."""

import pkgutil
import re
import shlex
import shutil
import sys
import tomllib
from pathlib import Path
from typing import Any

import pytest

from scenes.loading import builtin_text
from validate.cli import main
from validate.cli.arguments import parse

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


@pytest.mark.parametrize("page", ["CONTRIBUTING.md", "ARCHITECTURE.md"])
def test_the_places_to_add_to_are_the_true_ones(page):
    """Each name in backquotes is in the file named after it."""
    text = (ROOT / page).read_text(encoding="utf-8")
    named = re.findall(r"`(\w+)`(?: or `(\w+)`)?(?: there)?,? (?:in|of)\s+`([\w/]+\.py)`", text)
    assert len(named) >= 5
    for *names, file in named:
        code = (ROOT / file).read_text(encoding="utf-8")
        assert [name for name in names if name and not re.search(rf"^(def |class )?{name}\b", code, re.MULTILINE)] == []


def test_the_walk_to_a_verdict_is_there():
    """At most 15 steps, each of whose names is one; and each file of the page exists."""
    text = (ROOT / "ARCHITECTURE.md").read_text(encoding="utf-8")
    assert [file for file in re.findall(r"`([\w/]+\.py)`", text) if not any(ROOT.rglob(file))] == []
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


PRINTING = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *PAGES]
DATA = "time (ms),peak (K),current (mA)\n0,293,3.33\n0.5,306,3.32\n1,311,3.31\n"
VAPP = ('voltage = "1 V"', 'voltage = "Vapp"'), ("[parameters]", '[parameters]\nVapp = "1 V"')
# Files that the reader of a page brings, as the page describes them.
FILES = {
    "docs/howto/own-model.md": {"measured.csv": "time (ms),heater (degC)\n0,20\n1,80\n2,90\n3,95\n4,97\n"},
    "docs/howto/inputs.md": {"measured.csv": DATA},
    "docs/howto/bring-your-own.md": {
        "probes.csv": DATA,
        "iv.csv": "U (V),middle (K)\n0.5,320\n1,400\n",
        "sweep.txt": "V0 (V)  w0 (um)  Time (ms)  peak (K)\n"
        + "".join(f"{v} 100 {t} {293 + 20 * t * v**2}\n" for v in (1, 2) for t in (0, 0.5, 1, 2)),
        "probes.txt": 't,"T (K), Point 1",end\n0,293,0\n1,311,4000\n2,313,4400\n',
    },
}


def commands(page: Path) -> list[str]:
    """Return the `validate` commands of a page's bash blocks, without comments, pipes and redirections."""
    text = page.read_text(encoding="utf-8")
    lines = [
        line
        for block in re.findall(r"```bash\n(.*?)```", text, re.DOTALL)
        for line in block.replace("\\\n", "").splitlines()
    ]
    parts = [part.strip() for line in lines for part in re.split(r"&&|;|\s#", line)]
    return [part for part in parts if part.startswith("validate ")]


WITH_COMMANDS = [page for page in PRINTING if commands(page)]


def planned(words: list[str]) -> list[str]:
    """Return the words that plan a command: a sweep by a run of its first design; none where nothing can be planned."""
    if words[0] in ("sink", "device", "solve"):
        return [*words, *["--dry-run"] * ("--json" not in words)]
    if words[0] in ("sweep", "map"):
        kind = words[1] if words[1] in ("sink", "device") else f"solve {words[1]}"
        designs = [[*word.split("=")[:-1], re.split(r"[:,]", word.split("=")[-1])[0]] for word in words if "=" in word]
        return [*kind.split(), *(f"--set={'='.join(design)}" for design in designs), "--dry-run"]
    return words if words[0] in ("scene", "completion") else []


@pytest.mark.parametrize("page", WITH_COMMANDS, ids=lambda page: str(page.relative_to(ROOT)))
def test_commands_of_a_page_run_in_one_folder(page, tmp_path, monkeypatch, capsys):
    name = str(page.relative_to(ROOT))
    monkeypatch.chdir(tmp_path)
    shutil.copytree(ROOT / "examples", "examples")
    for file in (ROOT / "examples").glob("lumped*"):
        shutil.copy(file, ".")
    scenes = {"mine": builtin_text("hotplate"), "bridge": builtin_text("bridge")}
    if name == "docs/howto/bring-your-own.md":
        scenes["mine"] = scenes["bridge"].replace(*VAPP[0]).replace(*VAPP[1])
    files = {f"{scene}.toml": text for scene, text in scenes.items()} | FILES.get(name, {})
    for file, text in files.items():
        Path(file).write_text(text, encoding="utf-8")
    for command in commands(page):
        line, _, target = (part.strip() for part in command.split(" | ")[0].partition(" > "))
        words = shlex.split(line)[1:]
        parse(words)
        words = [*words, "--no-figures"] if name == "README.md" and words[0] != "scene" else planned(words)
        if not words:
            continue
        status = main(words)
        output = capsys.readouterr()
        complaints = [text for text in output.err.splitlines() if not re.search(r"\(\d+ s\)$", text)]  # not progress
        assert (status, complaints) == (0, []), f"{command}: {output.err}"
        if target:
            Path(target).write_text(output.out, encoding="utf-8")


def test_scene_snippets_of_pages_are_toml():
    blocks = [
        b for page in PRINTING for b in re.findall(r"```toml\n(.*?)```", page.read_text(encoding="utf-8"), re.DOTALL)
    ]
    assert len(blocks) > 5
    for block in blocks:
        assert tomllib.loads(block)


# The commands by which a page's Python blocks find their files, in the folder that follows.
PREPARED = {
    "docs/howto/compact-models.md": ("solve bridge --no-figures --export model", "model"),
    "docs/howto/device-export.md": ("device --figure 9 --no-figures --export sensor", "sensor"),
    "docs/howto/fields.md": ("sink --no-figures --fields --out results/sink-1V-fields", "."),
}
PYTHON = [page for page in (ROOT / "README.md", *PAGES) if "```python" in page.read_text(encoding="utf-8")]


@pytest.mark.long
@pytest.mark.parametrize("page", PYTHON, ids=lambda page: str(page.relative_to(ROOT)))
def test_python_of_a_page_runs(page, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    command, folder = PREPARED.get(str(page.relative_to(ROOT)), ("", "."))
    if command:
        assert main(command.split()) == 0
    monkeypatch.chdir(tmp_path / folder)
    monkeypatch.syspath_prepend(str(tmp_path / folder))
    shutil.copy(ROOT / "examples" / "array.py", "array_of_sinks.py")
    pyvista = pytest.importorskip("pyvista")
    monkeypatch.setattr(pyvista, "OFF_SCREEN", True)
    for name in ("model", "controllers", "array_of_sinks"):
        monkeypatch.delitem(sys.modules, name, raising=False)
    names: dict[str, Any] = {}
    for block in re.findall(r"```python\n(.*?)```", page.read_text(encoding="utf-8"), re.DOTALL):
        exec(block, names)
    for name, test in names.items():
        if name.startswith("test_"):
            test()
