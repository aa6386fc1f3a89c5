"""Commands that README and the pages print: each is planned by --dry-run, or runs where it is quick."""

import ast
import re
import shlex
import shutil
from pathlib import Path

import pytest

from scenes.loading import builtin_text
from validate.cli import main
from validate.cli.arguments import parse

ROOT = Path(__file__).parents[1]
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").rglob("*.md"))]
DATA = "time (ms),peak (K),current (mA)\n0,293,3.33\n0.5,306,3.32\n1,311,3.31\n"
VAPP = ('voltage = "1 V"', 'voltage = "Vapp"'), ("[parameters]", '[parameters]\nVapp = "1 V"')
# Files that the reader of a page brings, as the page describes them.
FILES = {
    "docs/howto/own-model.md": {"measured.csv": "time (ms),heater (degC)\n0,20\n1,80\n2,90\n3,95\n4,97\n"},
    "docs/howto/inputs.md": {"measured.csv": DATA},
    "docs/howto/bring-your-own.md": {
        "probes.csv": DATA,
        "iv.csv": "U (V),middle (K)\n0.5,320\n1,400\n",
        "sweep.txt": "V0 (V)  w0 (um)  Time (ms)  maxop1(T) (K)\n"
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


WITH_COMMANDS = [page for page in PAGES if commands(page)]


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


def test_python_blocks_of_the_readme_name_what_exists():
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    blocks = re.findall(r"```python\n(.*?)```", text, re.DOTALL)
    assert blocks
    for block in blocks:
        tree = ast.parse(block)
        modules = {}
        for node in ast.walk(tree):
            if isinstance(node, ast.Import):
                modules |= {a.asname or a.name: __import__(a.name) for a in node.names}
            elif isinstance(node, ast.ImportFrom):
                module = __import__(str(node.module), fromlist=[a.name for a in node.names])
                assert [a.name for a in node.names if not hasattr(module, a.name)] == []
        used = [
            (node.value.id, node.attr)
            for node in ast.walk(tree)
            if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name) and node.value.id in modules
        ]
        assert [(m, name) for m, name in used if not hasattr(modules[m], name)] == []
