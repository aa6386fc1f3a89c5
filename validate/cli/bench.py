"""Run time against error on the default sink: this toolkit's whole runs, the 1D reductions and
scikit-fem; the time that each skip of the plan saves; start-up. Takes half an hour; --quick a minute.

examples:
  validate bench --quick
  validate bench --part transient --part steady --rounds 5
  validate bench --markdown docs/benchmark.md --json benchmark.json

exit status: 0 measured (an entry that fails is a row with the reason), 2 bad input, 3 no reference could be made
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from scenes.errors import SceneError
from validate.cli import common
from validate.cli.terminal import FINE, progress, show, style

if TYPE_CHECKING:
    from benchmarks import bench

ROUNDS, QUICK_ROUNDS = 3, 1  # Defaults of --rounds, without and with --quick.
FOLDER = Path("results/bench")  # Where plots go if no page is written.


OPTIONS = {
    "--part {transient,steady,skips,start-up} ...": "this part only, as often as needed",
    "--quick": "fewer and coarser entries, one round: to see that it works",
    "--rounds N": f"how often each entry is started (default {ROUNDS}, with --quick {QUICK_ROUNDS})",
    "--markdown FILE": "write the page, and its plots to figures/ beside it (default: plots only, to "
    "results/bench/)",
    "--json FILE": "write every number",
}  # fmt: skip


def run(arguments: argparse.Namespace) -> int:
    rounds = common.whole("--rounds", arguments.rounds or str(QUICK_ROUNDS if arguments.quick else ROUNDS), 1, 100)
    page_file, numbers = (None if name is None else Path(name) for name in (arguments.markdown, arguments.json))
    files = [file for file in (page_file, numbers) if file is not None]
    for file in files:
        if not file.parent.is_dir():
            raise SceneError(f'"{file}" can\'t be written: there is no folder "{file.parent}"')
    from benchmarks.bench import PARTS, preface, sections_of
    from benchmarks.bench import run as measure
    from compare.report import Section
    from validate.report.summary import as_json, write_document
    from validate.report.text import section_text

    wanted = arguments.part or [part for part in PARTS if part != "start-up" or not arguments.quick]
    with progress() as say:
        measurements = measure(wanted, rounds, arguments.quick, say)
    folder = FOLDER if page_file is None else page_file.parent / "figures"
    sections = sections_of(measurements)
    drawn = {part: folder / f"benchmark-{part}.png" for part in ("transient", "steady") if part in measurements}
    for part, path in drawn.items():
        folder.mkdir(parents=True, exist_ok=True)
        _draw(sections[part][0], measurements[part], path)
    if numbers is not None:
        write_document(numbers, as_json(measurements))
    if page_file is not None:
        lines = ["# Run time against error", "", *_markdown(preface(measurements))]
        for name, (title, content) in sections.items():
            lines += [f"## {title}", "", *_markdown(content)]
            lines += [f"![{name}](figures/{drawn[name].name})", ""] if name in drawn else []
        page_file.write_text("\n".join(lines).rstrip() + "\n", encoding="utf-8")
    written = ", ".join(map(str, [*files, *drawn.values()]))
    texts = [section_text(Section(title, content[:2]), style()) for title, content in sections.values()]
    show("\n\n".join(texts) + (f"\n\nWrote {written}" if written else ""))
    return FINE


def _markdown(parts: bench.Content) -> list[str]:
    from validate.report.text import markdown

    return [line for part in parts for line in ([part, ""] if isinstance(part, str) else markdown(part))]


def _draw(title: str, measurements: dict[str, Any], path: Path) -> None:
    """Draw time over error, both logarithmic; a line joins the entries of a tool, reductions have a mark each."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    from benchmarks.bench import REDUCTION, TOOLS
    from validate.report.figures import drawing

    rows = [row for row in measurements["rows"] if not row["failure"]]
    with drawing.style():
        figure = drawing.new_figure(7.2, 4.6, f"{title}: time against error", ())
        axes = figure.add_subplot()
        for tool, colour, marker in zip(TOOLS, ("#8b1a1a", "#f0a030"), "oD", strict=True):
            points = [(row["error"], row["median_s"]) for row in rows if row["tool"] == tool]
            if points:
                axes.plot(*zip(*points, strict=True), marker=marker, color=colour, label=tool, linewidth=1.2)
        for row, marker in zip((row for row in rows if row["tool"] == REDUCTION), "x+sDov", strict=False):
            axes.plot(row["error"], row["median_s"], marker, color="#222222", fillstyle="none", label=row["label"])
        axes.set(xscale="log", yscale="log", xlabel="error, relative", ylabel="processor time, s (start-up apart)")
        axes.invert_xaxis()
        axes.legend(fontsize=8, ncols=2)
        FigureCanvasAgg(figure)
        figure.savefig(path, dpi=drawing.DPI)
