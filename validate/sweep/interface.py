"""A sweep from Python: an `xarray.Dataset` of its points."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

from scenes.errors import SceneError
from scenes.sink import Sink
from validate.sweep.design import Design, base, listed, parse
from validate.sweep.point import Job, Scope, checked
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
        import xarray
    except ImportError:
        raise ImportError(
            "a sweep from Python needs xarray: pip install 'heated-microstructure-validation[sweep]'"
        ) from None
    if figures and out is None:
        raise SceneError("figures need a folder to go to: give out=")
    found = base(scene, [f"run.accuracy={accuracy!r}"])
    form = "grid" if sample is None else "sample"
    axes = [
        parse(found, f"{key}={given}", form) if isinstance(given, str) else listed(found, key, list(given))
        for key, given in (vary or {}).items()
    ]
    design = Design(tuple(axes), sample, seed)
    names = [reduction] if isinstance(reduction, str) else reduction
    scope = Scope(tuple(map(canonical, names)), steady, checked(found, check, steady, design.keys), blame)
    job, say = Job(found, design, scope), progress or (lambda _: None)
    with TemporaryDirectory() as folder, Store(Path(out or Path(folder, "sweep")), job.document(), fresh) as store:
        table, document = run(
            job, store, say, workers=workers, scheduler=scheduler, seconds=point_timeout, figures=figures
        )
    dims = design.keys if sample is None else ("point",)
    columns = {name: (dims, column.reshape(design.shape)) for name, column in table.columns.items()}
    places: dict[str, Any] = {axis.key: (axis.key, list(axis.values)) for axis in design.axes}
    if sample is not None:
        places = {key: ("point", values) for key, values in table.keys.items()}
    coordinates = {key: (*place, {"units": table.units[key]}) for key, place in places.items()}
    return xarray.Dataset(columns, coordinates, {"sentence": document["sentence"], "scene": found.name})
