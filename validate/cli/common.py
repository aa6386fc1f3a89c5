"""The parts that commands share: options, the run of a scene, and tables that judge.

Tables of rows that judge, as text, as a page in Markdown and as JSON.
"""

from __future__ import annotations

import argparse
import json
import math
import textwrap
import time
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict
from importlib import import_module
from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING, Any

from benchmarks.rows import Row
from compare.options import FREE, TABLE, Option, check, of_kind, read, settings, whole
from compare.report import Row as Line
from compare.report import Section, Style, Table
from scenes.errors import SceneError, quoted, reason
from scenes.keys import TYPES
from scenes.loading import load, load_free
from validate.cli.terminal import BAD_INPUT, DIFFERS, FINE, INTERRUPTED, NUMERICS, complain, progress, show, style
from validate.folder import folder_of_run
from validate.report import text as texts
from validate.report.summary import as_json

if TYPE_CHECKING:
    from compare.outcome import Outcome
    from scenes.result import Step


_SHARED = {option.flag: option.help for option in TABLE} | {
    "--jobs N": "processes at once (default: one a processor)",
    "--markdown FILE": "write the table as a page of the documentation too",
    "--quiet": "print one line only",
    "--json": "print summary.json in place of the tables",
}
"""The help texts of options that several commands have."""
OF_A_TABLE = {
    "--jobs N": "", "--markdown FILE": "", "--quiet": "print the outcome only, one line",
    "--json": "print the table as JSON",
}  # fmt: skip
VERDICTS = ("agrees", "differs", "unresolved")


def add(parser: argparse.ArgumentParser, options: Mapping[str, str]) -> None:
    """Add options with their helps (empty for options of the table), in the words of a usage line: "--voltage V" takes
    a value, "--only {3d,1d}" one of these, "--column NAME=COLUMN ..." is given as often as needed, "--check ID!" must
    be given, "--steady" is a switch, and "--no-figures" switches ``figures`` off. A name without dashes is a positional
    argument, in brackets where it is optional: "[scene SCENE.toml]"."""
    for usage, said in options.items():
        bare = usage[1:-1] if usage.startswith("[") else usage.removesuffix("!").removesuffix(" ...")
        name, _, value = bare.partition(" ")
        keywords: dict[str, Any] = {"help": said or _SHARED[usage]}
        if value.startswith("{"):
            keywords["choices"] = value.strip("{}").split(",")
        elif value:
            keywords["metavar"] = value
        elif name.startswith("--no-"):
            keywords |= {"action": "store_false", "dest": name.removeprefix("--no-")}
        else:
            keywords["action"] = "store_true"
        if usage.endswith(" ..."):
            keywords |= {"action": "append", "default": []}
        if usage.endswith("!"):
            keywords["required"] = True
        if usage.startswith("["):
            keywords["nargs"] = "?"
        parser.add_argument(name, **keywords)


def options_of(kind: str) -> dict[str, str]:
    """The options of a run of a kind of scene, from the options table."""
    scene = {"scene SCENE.toml": "a scene file, or an example: bridge, plate, hotplate"}
    if kind in TYPES:
        scene = {"[scene SCENE.toml]": f'a scene file (default: the built-in "{kind}")'}
    return scene | {o.flag: o.help for o in of_kind(kind)}


def given(arguments: argparse.Namespace, kind: str) -> dict[str, Any]:
    """Return the options that were given, by keyword."""
    values = vars(arguments)

    def value(option: Option) -> Any:
        return values.get(option.name.lstrip("-").replace("-", "_").removeprefix("no_"), values.get(option.key))

    return {o.key: value(o) for o in of_kind(kind) if value(o) not in (None, [], False) or o.name == "--no-figures"}


def run(kind: str, arguments: argparse.Namespace) -> int:
    """Explain, solve, report and write a scene, the answer first; return the exit status."""
    chosen = given(arguments, kind)
    named = out(arguments)
    check(kind, chosen)
    overrides = settings(kind, chosen, arguments.set)
    if kind in TYPES:
        scene = load(arguments.scene or kind, overrides, scene_type=TYPES[kind])
    else:
        scene = load_free(arguments.scene, overrides)
    options = read(kind, chosen, scene, arguments.command_line)
    if options.monte_carlo:
        import_module("validate.sweep.monte_carlo")  # which adds its analysis
    folder = named or folder_of_run(kind, chosen, scene, overrides if kind == FREE else arguments.set)
    planned = None
    if arguments.explain or arguments.dry_run:
        from validate.report.output import plan

        planned = plan(scene, options)
        show(plan_text(planned, style()) + ("\n" if arguments.explain else ""))
    if arguments.dry_run:
        return FINE
    from compare.outcome import Progress
    from validate.report.checks import contrary
    from validate.report.output import run as write

    with progress(arguments.quiet) as say:

        def tell(outcome: Outcome[Any]) -> None:
            say("")  # which clears the line
            if arguments.quiet:
                show(" ".join(texts.headline(outcome, style()).split()))
            elif not arguments.json:
                show(texts.report(outcome, style()) + "\n")

        outcome = write(scene, options, folder, Progress(say), tell)
    if arguments.json:
        show((outcome.folder / "summary.json").read_text(encoding="utf-8").rstrip("\n"))
    elif not arguments.quiet:
        show(kept_text(outcome, planned))
    if outcome.runs_away:
        return complain(outcome.runs_away, NUMERICS)
    if isinstance(outcome.failure, KeyboardInterrupt):
        return INTERRUPTED
    if outcome.failure is not None:
        kept = f"{outcome.failure}; what 3D found is kept"
        return complain(kept, BAD_INPUT if isinstance(outcome.failure, SceneError) else NUMERICS)
    return DIFFERS if contrary(outcome) else FINE


def kept_text(outcome: Outcome[Any], planned: Sequence[Step] | None = None) -> str:
    """Return the results folder of a run, its files and times, and the steps that differ from the printed plan."""
    changed = [step for step in outcome.plan if planned is not None and step not in planned]
    parts = [plan_text(changed, style(), "As it turned out", "done")] * bool(changed)
    files = outcome.files
    kinds: list[str] = [name for name in ("report.html", "summary.json", "traces.csv") if name in files]
    figures = sum(file.endswith(".svg") for file in files)
    kinds += [f"{figures} figure{'s' * (figures > 1)}"] * bool(figures) + ["fem3d.pvd"] * ("fem3d.pvd" in files)
    said = f"{', '.join(kinds)}. Took {outcome.timing['total']:.1f} s."
    said += f" Replaces the earlier run ({outcome.replaced})." if outcome.replaced else ""
    folder, here = outcome.folder, Path.cwd()
    # A path is not broken over lines, so that it can be copied.
    where = f"Results in {folder.relative_to(here) if folder.is_relative_to(here) else folder}/\n"
    return "\n\n".join([*parts, where + texts.wrapped(said, "  ", "  ")])


def plan_text(steps: Sequence[Step], style: Style, title: str = "Plan", done: str = "planned") -> str:
    """The plan: each step with its state, where it is not skipped ``done``, and reason."""
    lines = [texts.paint(title, "heading", style)]
    for step in steps:
        mark, state = ("-", step.state) if step.state == "skipped" else ("+", done)
        text = f"{mark} {state:<8}{step.step}: {step.reason}"
        lines.append(textwrap.fill(text, texts.WIDTH, initial_indent="  ", subsequent_indent=" " * 12))
    return "\n".join(lines)


def out(arguments: argparse.Namespace) -> Path | None:
    """Return the folder of --out; raise SceneError where it has no name."""
    if arguments.out is not None and not arguments.out.strip():
        raise SceneError('--out "" names no folder: give one, such as results/mine')
    return Path(arguments.out) if arguments.out else None


def refuse(*faults: tuple[object, str]) -> None:
    """SceneError with the sentence of the first fault that is one."""
    for is_one, sentence in faults:
        if is_one:
            raise SceneError(sentence)


def table(
    arguments: argparse.Namespace, title: str, about: str, find: Callable[..., Sequence[Row]], more: str = ""
) -> Sequence[Row]:  # fmt: skip
    """Find the rows of a table with a number of processes, print them as text or JSON, write the page,
    and return the rows. Raises SceneError where the page can't be written."""
    from compare.processes import processors
    from validate.report.summary import provenance

    jobs = processors() if arguments.jobs is None else whole("--jobs", arguments.jobs, 1, 256)
    started = time.perf_counter()
    with progress() as say:
        rows = find(jobs, say)
    seconds = time.perf_counter() - started
    if arguments.markdown is not None:
        page = markdown(rows, title, about, provenance(), more).rstrip("\n") + "\n"
        try:
            Path(arguments.markdown).write_text(page, encoding="utf-8")
        except OSError as error:
            raise SceneError(f"--markdown {quoted(arguments.markdown)} can't be written: {reason(error)}") from None
    if arguments.json:
        show(json.dumps(document(rows, provenance(), seconds), indent=1, allow_nan=False))
    elif arguments.quiet:
        show(headline(rows))
    else:
        show(f"{text(rows, style())}\n\n{seconds:.0f} s")
    return rows


def counts(rows: Sequence[Row]) -> dict[str, int]:
    """Return the number of rows by verdict."""
    count: Counter[str] = Counter(row.verdict for row in rows)
    return {verdict: count[verdict] for verdict in VERDICTS}


def headline(rows: Sequence[Row]) -> str:
    """Return how many rows agree and how many do not."""
    number = counts(rows)
    words = {"differs": "differ", "unresolved": "unresolved"}
    others = [f"{number[verdict]} {word}" for verdict, word in words.items() if number[verdict]]
    return ", ".join([f"{number['agrees']} of {len(rows)} rows agree", *others]) + "."


def text(rows: Sequence[Row], style: Style) -> str:
    """Return the tables for a terminal: the rows of a case below its name, with the notes of rows that do not agree."""
    parts = [texts.paint(headline(rows), "heading", style)]
    for group, members in groupby(rows, lambda row: row.group):
        lines = []
        for case, each in groupby(members, lambda row: row.case):
            lines.append(Line([case]))
            lines += [_line(row) for row in each]
        table = Table(("", "found", "expected", "within"), lines)
        parts.append(texts.section_text(Section(_title(group), [table]), style))
    return "\n\n".join(parts)


def _line(row: Row) -> Line:
    agrees = row.verdict == "agrees"
    vague = f"only within {row.bound:.1e}, not {row.settled:.1e}" if row.verdict == "unresolved" else ""
    below = "" if agrees else ": ".join(filter(None, (row.verdict, vague, row.note)))
    return Line([_quantity(row), *_numbers(row)], row.verdict, below)


def markdown(rows: Sequence[Row], title: str, about: str, versions: Mapping[str, str], more: str = "") -> str:
    """Return the page; it has ``more`` beside the headline."""
    programs = ", ".join(f"{name} {version}" for name, version in versions.items())
    lines = [f"# {title}", "", about, f"**{headline(rows)}**{more}", "", f"{programs}.", ""]
    heads = ("case", "quantity", "found", "expected", "within", "verdict", "note")
    for group, members in groupby(rows, lambda row: row.group):
        cells = [[row.case, _quantity(row), *_numbers(row), row.verdict, row.note] for row in members]
        lines += [f"## {_title(group)}", "", *texts.markdown(Table(heads, cells, "<<>>><<"))]
    return "\n".join(lines)


def document(rows: Sequence[Row], versions: Mapping[str, str], seconds: float) -> dict[str, Any]:
    """Return the rows as JSON."""
    listed = [asdict(row) | {"difference": row.difference, "verdict": row.verdict} for row in rows]
    content = {"schema": 2, "provenance": versions, "timing_s": seconds, "counts": counts(rows), "rows": listed}
    return {key: as_json(value) for key, value in content.items()}


def _title(group: str) -> str:
    return group[:1].upper() + group[1:]


def _quantity(row: Row) -> str:
    return f"{row.quantity} ({row.unit})" if row.unit else row.quantity


def _numbers(row: Row) -> tuple[str, str, str]:
    """Return value, expected value and bound, with digits down to a hundredth of the bound."""
    ratio = abs(row.expected) / row.bound if row.bound > 0 and row.expected else 1.0
    digits = min(max(math.ceil(math.log10(ratio)) + 2, 3), 12) if math.isfinite(ratio) and ratio > 0 else 3
    sign = "" if row.relation == "near" else f"{row.relation} "
    return f"{row.found:.{digits}g}", f"{sign}{row.expected:.{digits}g}", f"{row.bound:.3g}" if row.bound else ""
