"""Run a sweep, or the map of a tolerance's line, in its folder: store each row, then write the files."""

from __future__ import annotations

import fcntl
import json
import os
import re
import time
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, TextIO

from compare.processes import processors
from scenes.errors import SceneError, quoted, reason
from scenes.model import AnyScene
from scenes.sink import Sink
from validate.folder import check_room
from validate.sweep.design import Design, Job, Row, Task, listed, load, parse, parse_reductions, prepare
from validate.sweep.mapping import VERDICTS, refine
from validate.sweep.table import Table, read

ROWS, SUMMARY = "points.jsonl", "sweep.json"
_OLD = re.compile(r"(points|map)\.csv|report\.html|figure_\w+\.(png|svg)")


class Store:
    """A context that locks a folder, reads the ``rows`` of an earlier run, by point, and appends further ones.

    The file of rows has a line for each; a line that a kill has torn, or that is no row, is ignored.
    """

    def __init__(self, folder: Path, request: Mapping[str, Any], fresh: bool = False) -> None:
        self.folder, self._given, self._request, self._fresh = Path(os.path.realpath(folder)), folder, request, fresh
        self.rows: dict[int, Row] = {}

    def __enter__(self) -> Store:
        """Raises SceneError for a folder that can't be written, holds something else, or is in use."""
        shown = quoted(self._given)
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            names = {path.name for path in self.folder.iterdir() if not path.name.startswith(".")}
            if names - {ROWS} and SUMMARY not in names:
                raise ValueError("it has files that are not a sweep, and is left as it is")
            self._file = (self.folder / ROWS).open("a+b")
            fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise SceneError(f"{shown} is in use by another sweep or map: wait for it, or give another --out") from None
        except (OSError, ValueError) as error:
            raise SceneError(f"folder {shown} cannot be written ({reason(error)}): give another with --out") from None
        try:
            self._begin()
        except BaseException as error:
            self.__exit__(None, error)
            raise
        return self

    def __exit__(self, kind: object, error: object, trace: object = None) -> None:
        try:
            check_room(error, self.folder, self._given, "and the same command goes on: what is solved is stored")
        finally:
            with suppress(OSError):  # the buffer still holds unwritten bytes
                self._file.close()

    def append(self, row: Row) -> None:
        """Write a row, which is on disk when this returns."""
        self.rows[row["point"]] = row
        self._file.write((json.dumps(row) + "\n").encode())
        self._file.flush()
        os.fsync(self._file.fileno())

    @contextmanager
    def writing(self, name: str) -> Iterator[TextIO]:
        """Open a file that is put into the folder at the end, whole or not at all."""
        partial = self.folder / f".{name}"
        with partial.open("w", encoding="utf-8", newline="") as file:
            yield file
            file.flush()
            os.fsync(file.fileno())
        partial.replace(self.folder / name)

    def _begin(self) -> None:
        """Read the rows of an earlier run of the same request; refuse another, or remove it for a fresh start."""
        summary, earlier = self.folder / SUMMARY, dict[str, Any]()
        if self._fresh or not summary.exists():
            self._file.truncate(0)
            for path in self.folder.iterdir():
                if _OLD.fullmatch(path.name):
                    path.unlink()
        else:
            with suppress(ValueError, KeyError, TypeError):  # of a file that somebody changed
                earlier = dict(json.loads(summary.read_text(encoding="utf-8"))["asked"])
            if earlier != self._request:
                key = next((key for key, value in self._request.items() if earlier.get(key) != value), "request")
                held = f"{quoted(self._given)} holds another sweep (its {key.replace('_', ' ')} differs)"
                raise SceneError(f"{held}: give another folder with --out, or --fresh to start over")
        with self.writing(SUMMARY) as file:
            json.dump({"schema": 1, "asked": self._request, "finished": False}, file)
        self._file.seek(0)
        line = b"\n"
        for line in self._file:
            with suppress(ValueError, TypeError, KeyError):
                row = json.loads(line)
                self.rows[row["point"]] = row
        if not line.endswith(b"\n"):
            self._file.write(b"\n")


def run(
    job: Job, store: Store, say: Callable[[str], None], *, workers: int | None = None, scheduler: str | None = None,
    seconds: float | None = None, figures: bool = False,
) -> tuple[Table, dict[str, Any]]:  # fmt: skip
    """Solve all points that are not stored, write the files, and return the columns and the content of sweep.json.

    ``workers`` processes here (default: one a processor) or a ``scheduler``'s solve, with ``seconds`` for each point.
    Raises SceneError for an unusable scheduler, and NumericsError.
    """
    from validate.sweep.point import solver

    started, count = time.monotonic(), job.design.count
    say("starting the workers")
    with solver(min(workers or processors(), max(count - len(store.rows), 1)), scheduler, seconds) as solve:

        def gather(tasks: Iterable[Task], remark: str) -> None:
            for row in solve(tasks):
                store.append(row)
                say(f"{len(store.rows)} points{remark}")

        cells = None
        if job.solves is None:
            gather((job.task(number) for number in range(count) if number not in store.rows), f" of {count}")
        else:
            cells = refine(job, store.rows, gather)
    say("writing the results")
    table = read(job, store.rows, cells)
    return table, _write(store, table, figures, time.monotonic() - started)


def _write(store: Store, table: Table, figures: bool, seconds: float) -> dict[str, Any]:
    """Write the files; return the content of sweep.json."""
    from compare import report
    from validate.report import page
    from validate.report.output import write_columns
    from validate.report.summary import as_json, provenance

    columns, asked = table.columns, table.job.asked
    counts: dict[str, Any] = {"points": len(table), **Counter(columns["status"].tolist())}
    tables = {"points.csv": table.keys | columns}
    if table.map:
        tables["map.csv"] = table.map
        counts["cells"] = {"all": table.job.design.count, **Counter(table.map["verdict"].tolist())}
    for name, content in tables.items():
        with store.writing(name) as file:
            write_columns(file, content, missing="")
    files = [*tables]
    if figures:
        from validate.report.figures.drawing import save, style
        from validate.sweep.figures import draw

        with style():
            files += [file for name, figure in draw(table).items() for file in save(figure, store.folder, name)]
    made = {name.removesuffix("_verdict"): words for name, words in columns.items() if name.endswith("_verdict")}
    document: dict[str, Any] = as_json(
        {
            "schema": 1,
            "asked": asked,
            "finished": True,
            "sentence": table.sentence,
            "counts": counts,
            "verdicts": {check: dict(Counter(filter(None, words.tolist()))) for check, words in made.items()},
            "seconds": {"this_run": round(seconds, 1), "points": round(float(columns["seconds"].sum()), 1)},
            "provenance": provenance(),
            "files": [*files, "report.html", SUMMARY],
        }
    )
    rows = [[check, *(str(n.get(word, 0)) for word in VERDICTS)] for check, n in document["verdicts"].items()]
    sections = [report.Section("Checks", [report.Table(("check", *VERDICTS), rows)] if rows else [])]
    with store.writing("report.html") as file:
        said, content = f"{table.sentence}.", document | {"scene": asked["scene"]["document"]}
        file.write(page.page(store.folder, asked["scene"]["name"], said, sections, content))
    with store.writing(SUMMARY) as file:
        json.dump(document, file, indent=1)
    return document


def sweep(
    scene: Sink | AnyScene | str | Path = "sink",
    vary: Mapping[str, Sequence[Any] | str] | None = None,
    *,
    sample: int | None = None,
    seed: int = 0,
    reduction: str | Sequence[str] = "paper",
    steady: bool = False,
    accuracy: float = 1e-2,
    check: str | None = None,
    blame: bool = True,
    workers: int | None = None,
    scheduler: str | None = None,
    point_timeout: float | None = None,
    model: str = "",
    out: str | Path | None = None,
    fresh: bool = False,
    figures: bool = False,
    progress: Callable[[str], None] | None = None,
) -> Table:
    """Solve and compare a scene at many designs, and return the columns of points.csv.

    ``vary`` has the values of each key: numbers in SI units, texts with units, words, or the text of a command line,
    "10um:200um:20", with ``sample`` "10um:200um". Solved points are kept in the folder ``out``, where the same call
    goes on; without it nothing stays. ``model`` is the file of the user's own model of a free scene, as for --model.
    ``point_timeout`` is in s; ``workers`` are processes (default: one a processor). Raises SceneError for bad input,
    ArithmeticError where a cluster is lost.
    """
    if figures and out is None:
        raise SceneError("figures need a folder to go to: give out=")
    given, asked = load(scene, [f"run.accuracy={float(accuracy)!r}"])
    form = "grid" if sample is None else "sample"
    axes = [
        parse(given, f"{key}={values}", form) if isinstance(values, str) else listed(given, key, list(values))
        for key, values in (vary or {}).items()
    ]
    models = parse_reductions([model or reduction] if isinstance(reduction, str) else reduction)
    job = prepare(given, asked, Design(tuple(axes), sample, seed), models, check, steady, blame)
    with TemporaryDirectory() as folder, Store(Path(out or folder), job.asked, fresh) as store:
        say = progress or (lambda _: None)
        return run(job, store, say, workers=workers, scheduler=scheduler, seconds=point_timeout, figures=figures)[0]
