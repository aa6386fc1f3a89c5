"""A sweep from Python: an `xarray.Dataset` of its points."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

from scenes.errors import SceneError
from scenes.sink import Sink
from validate.processes import processors
from validate.sweep import axes
from validate.sweep.axes import Axis
from validate.sweep.base import Base, base
from validate.sweep.design import Design
from validate.sweep.job import Job, Means, checked
from validate.sweep.output import Outcome, write
from validate.sweep.point import Scope
from validate.sweep.run import run
from validate.sweep.store import Store

if TYPE_CHECKING:
    import xarray

    from scenes.model import AnyScene


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
    out: str | Path | None = None,
    fresh: bool = False,
    figures: bool = False,
    progress: Callable[[str], None] | None = None,
) -> xarray.Dataset:
    """Solve and compare a scene at many designs; the columns of points.csv as an ``xarray.Dataset``.

    ``vary`` has the values of each key: numbers in SI units, texts with units, words, or as on a command line the text
    "10um:200um:20", with ``sample`` "10um:200um". A grid's dimensions are the keys; a sample has one, "point". What is
    solved is kept in the folder ``out``, where the same call goes on; without it nothing stays. ``point_timeout`` is in
    s; ``workers`` are processes, one a processor if not given. Raises SceneError for bad input, ArithmeticError where a
    cluster is lost, ImportError without xarray.
    """
    from reduced1d.ladder import canonical

    try:
        import xarray  # noqa: F401
    except ImportError:
        raise ImportError(
            "a sweep from Python needs xarray: pip install 'heated-microstructure-validation[sweep]'"
        ) from None
    if figures and out is None:
        raise SceneError("figures need a folder to go to: give out=")
    found = base(scene, [f"run.accuracy={accuracy!r}"])
    design = Design(tuple(_axis(found, k, v, sample is not None) for k, v in (vary or {}).items()), sample, seed)
    names = [reduction] if isinstance(reduction, str) else reduction
    scope = Scope(tuple(map(canonical, names)), steady, checked(found, check, steady, design.keys), blame)
    job, say = Job(found, design, scope), progress or (lambda _: None)
    started = time.monotonic()
    with ExitStack() as stack:
        folder = Path(out) if out is not None else Path(stack.enter_context(TemporaryDirectory())) / "sweep"
        store = stack.enter_context(Store(folder, job.document(), fresh))
        run(job, store, Means(workers or processors(), scheduler, point_timeout), say)
        return dataset(job, write(job, store, None, figures, time.monotonic() - started))


def _axis(found: Base, key: str, given: Sequence[Any] | str, sampled: bool) -> Axis:
    if isinstance(given, str):
        return axes.parse(found, f"{key}={given}", "sample" if sampled else "grid")
    return axes.listed(found, key, list(given))


def dataset(job: Job, outcome: Outcome) -> xarray.Dataset:
    """The columns over the design's keys, with units; whole numbers of points only, as every sweep ends with."""
    import xarray

    table, design = outcome.table, job.design
    dims = design.keys if design.sample is None else ("point",)
    columns = {name: (dims, column.reshape(design.shape)) for name, column in table.columns.items()}
    coordinates: dict[str, Any] = {
        axis.key: (axis.key, list(axis.values), {"units": table.units[axis.key]}) for axis in design.axes
    }
    if design.sample is not None:
        coordinates = {key: ("point", values, {"units": table.units[key]}) for key, values in table.keys.items()}
    attributes = {"sentence": outcome.sentence, "scene": job.base.name}
    return xarray.Dataset(columns, coordinates, attributes)
