"""The options of a run, one row for each: they make the parser, the keywords in Python, refusals and folder names.

A row needs no other change than itself, unless an analysis reads its value (``options.NAME``).
"""

import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any, NamedTuple

from scenes import units
from scenes.errors import SceneError, printable, quoted
from scenes.keys import ACCURACY
from scenes.kinds import Quantity
from scenes.uncertain import read as read_uncertain
from scenes.units import TIME

SINK, DEVICE, FREE = "sink", "device", "free"
ALL = (SINK, DEVICE, FREE)
FIGURES = tuple(f"figure{number}" for number in range(9, 14))
"""The figures of a device."""
SAMPLES = 10, 100_000  # Bounds of --monte-carlo; fewer than 10 samples give no standard deviation worth the name.

Given = Mapping[str, Any]
Reader = Callable[[Any, Any, Given], Any]
"""Makes a value of the given text, the scene, and all that is given by keyword. A mapping sets several options."""


@dataclass(frozen=True)
class Option:
    """One option.

    Attributes
    ----------
    flag : usage: "--voltage V", "--column NAME=COLUMN ..." repeats, "--only {3d,1d}" has choices, "--steady" has none
    help : text for the command's help
    kinds : kinds of scenes that take it
    sets : key of the scene that it stands for
    read : makes the value of the text; without it the text is the value
    needs : flags of options that must be given too
    excludes : flags, perhaps with a value, "--only 1d", of options that must not be given too
    in_name : its part of the folder's name, with {} for the text; empty for none
    keyword : name in Python and of the value; empty for the terminal alone
    otherwise : the value where the option is not given, unless that follows from the flag
    """

    flag: str
    help: str
    kinds: Sequence[str] = ALL
    sets: str = ""
    read: Reader | None = None
    needs: Sequence[str] = ()
    excludes: Sequence[str] = ()
    in_name: str | None = None
    keyword: str | None = None
    otherwise: Any = None

    @property
    def name(self) -> str:
        """The flag without its value: "--voltage"."""
        return self.flag.split()[0]

    @property
    def key(self) -> str:
        """The keyword in Python: "voltage"; also of an option of the terminal alone."""
        return self.keyword or re.sub("^no_", "", self.name.lstrip("-").replace("-", "_"))

    @property
    def switch(self) -> bool:
        return " " not in self.flag

    @property
    def repeats(self) -> bool:
        return self.flag.endswith(" ...")

    @property
    def default(self) -> Any:
        """The value where the option is not given."""
        return () if self.repeats else self.name.startswith("--no-") if self.switch else self.otherwise


class Export(NamedTuple):
    """A compact model to make: folder, relative accuracy, and number of states (None: as few as the accuracy takes)."""

    folder: Path
    accuracy: float
    states: int | None = None


def whole(option: str, given: Any, least: int, most: int) -> int:
    """Read a whole number; SceneError outside of its bounds."""
    text = str(given)
    if not text.isascii() or not text.isdigit() or not least <= int(text) <= most:
        raise SceneError(f"{option} is {quoted(text)}: give a whole number from {least} to {most}")
    return int(text)


def texts(given: Any) -> tuple[str, ...]:
    """Return the texts of an option that repeats, also of one value, or of a mapping: {"sink.width": "1%"}."""
    if isinstance(given, Mapping):
        items = {key: str(value).lower() if isinstance(value, bool) else str(value) for key, value in given.items()}
        return tuple(f"{key}={value}" if value else key for key, value in items.items())
    return tuple(map(str, given)) if isinstance(given, Iterable) and not isinstance(given, str) else (str(given),)


def as_text(option: Option, given: Any) -> Any:
    """Return the value of a keyword in Python as the command line would have it. Raises SceneError."""
    if option.repeats:
        return texts(given)
    if option.switch and not isinstance(given, bool):
        raise SceneError(f"{option.key} is {quoted(given)}: give True or False")
    if option.switch or (option.key in ("model", "reduction") and callable(given)):
        return given
    text, (*_, choices) = ",".join(texts(given)), option.flag.partition("{")
    known = choices.rstrip("}").split(",")
    if choices and text not in known:
        raise SceneError(f"{option.key} is {quoted(text)}: give {' or '.join(known)}")
    return text


def _reduction(given: Any, scene: Any, _: Given) -> dict[str, Any]:
    """A 1D model of this program by its canonical name, or the user's own as ``model``."""
    from compare.models import parse_reduction

    name, model = parse_reduction(given)
    return {"reduction": name, "model": model}


def _data(given: Any, scene: Any, values: Given) -> Any:
    """The user's own data, read before anything is solved."""
    from compare.data.read import read

    return read(Path(given), scene, values.get("columns", ()), values.get("data_uncertainty", ()))


def _times(given: Any, scene: Any, _: Given) -> tuple[float, ...]:
    """Times (s) of further stored fields, up to the end of the run."""
    kind = Quantity(TIME, 0.0, scene.end_time, note=", the end of the run")
    return tuple(kind.read("--field-times", part.strip()) or 0.0 for part in given.split(","))


def _export(given: Any, scene: Any, values: Given) -> Export:
    """The accuracy is twice the solution's: half is the solution's, half the model's own."""
    if not str(given).strip():
        raise SceneError('--export "" names no folder: give one, such as my-model')
    of_device, wanted, states = scene.kind == DEVICE, values.get("model_accuracy"), values.get("states")
    solved = scene.accuracy_3d if of_device and values.get("in_3d") else scene.accuracy
    accuracy = 2 * solved
    if wanted is not None:
        accuracy = ACCURACY.read("--model-accuracy", wanted) or accuracy
        if of_device and accuracy < solved:
            raise SceneError(f"--model-accuracy {wanted} is below the solution's, {solved:g}: give --accuracy, too")
    return Export(Path(given), accuracy, None if states is None else whole("--states", states, 1, 400))


def _figures(given: Any, scene: Any, _: Given) -> tuple[str, ...]:
    """Figures of a device in their order: 9 or "figure9"."""
    wanted = {f"figure{str(name).removeprefix('figure')}" for name in given}
    if unknown := sorted(wanted - set(FIGURES)):
        raise SceneError(f"about={quoted(unknown[0])} is no figure: give {', '.join(FIGURES)}")
    return tuple(name for name in FIGURES if name in wanted)


def _limit(dimension: str, given: Any, scene: Any, _: Given) -> float:
    return Quantity(getattr(units, dimension), 1e-12, 1e6).read(f"--max-{dimension.lower()}", given) or 0.0


TABLE = (
    Option("--set KEY=VALUE ...", "override a key of the scene, such as sink.width=20um", in_name="", keyword=""),
    Option("--accuracy A", "relative accuracy of 3D (default 1e-3 or the scene's), or of a device's temperatures",
           sets="run.accuracy"),
    Option("--memory M", "the most memory that 3D may take, such as 8GB (default: the memory that is free)", (FREE,),
           sets="run.memory"),
    Option("--voltage V", 'voltage across the electrodes: 1, 2V or "500 mV"; for --set drive.voltage=V', (SINK,),
           sets="drive.voltage"),
    Option("--end-time T", "over time from the start to T, such as 2ms, whatever the scene says of it", (FREE,),
           sets="run.end_time", excludes=["--steady"]),
    Option("--only {3d,1d}", "one model only", (SINK,), in_name="{}"),
    Option("--reduction R", "the 1D model: paper (default), anchored, fin-massless, fin, plate or moments[:N]; or one "
           "of your own, FILE.py:FUNCTION, FILE.cir, FILE.fmu, FILE.csv, or network", (SINK,), read=_reduction,
           excludes=["--only 3d"], in_name="{}", otherwise="paper"),
    Option("--model M", "a 1D model of your own to judge: FILE.py:FUNCTION, FILE.cir (ngspice), FILE.fmu, FILE.csv, "
           "network (lines made of the boxes, as by hand), or scene for the scene's own [model]", (FREE,),
           otherwise=""),
    Option("--3d", "in 3D too, and how far 1D is off", (DEVICE,), keyword="in_3d"),
    Option("--figure {9,10,11,12,13} ...", "this figure and its checks only, as often as needed", (DEVICE,),
           read=_figures, in_name="figure{}", keyword="about"),
    Option("--scheme {accurate,paper}", "the accurate scheme (default), or the paper's own and how far it is off",
           (DEVICE,), in_name="{}", otherwise="accurate"),
    Option("--meter {PXI-4070,MAX1367}", "round the resistances to what a meter resolves", (DEVICE,), in_name="{}"),
    Option("--max-voltage V", "the sensor's largest voltage, for the range: 100mV", (DEVICE,), in_name="max{}",
           excludes=["--figure", "--scheme paper"], read=partial(_limit, "VOLTAGE"), keyword="largest_voltage",
           otherwise=float("inf")),
    Option("--max-power W", "the sensor's largest power, for the range: 20mW", (DEVICE,), in_name="max{}",
           excludes=["--figure", "--scheme paper"], read=partial(_limit, "POWER"), keyword="largest_power",
           otherwise=float("inf")),
    Option("--steady", "the steady state only, no transient", (SINK, FREE), sets="run.steady"),
    Option("--why", "split the 1D model's differences from 3D by its assumptions, or by the joints of --model network",
           (SINK, FREE), excludes=["--only"]),
    Option("--left-out", "what both models leave out, each solved in 3D, and all at once: the gas below and others",
           (SINK,), excludes=["--only 1d"]),
    Option("--sensitivities", "how the models follow each key: d ln quantity / d ln key, 1D against 3D"),
    Option("--uncertain KEY=U ...", "the standard uncertainty of a key, such as sink.width=0.1um or drive.voltage=1%%; "
           "or materials, for the scene's table of them",
           read=lambda given, scene, values: read_uncertain(scene, given, values.get("correlated", ()))),
    Option("--correlated KEY,KEY=R ...", "the correlation of two uncertain keys: pad_width,oxide_width=0.9",
           needs=["--uncertain"]),
    Option("--monte-carlo N", "with --uncertain, solve N samples of the inputs too: where is linear propagation off?",
           (SINK,), read=lambda given, *_: whole("--monte-carlo", given, *SAMPLES),
           needs=["--uncertain"], excludes=["--only"], keyword="", otherwise=0),
    Option("--against FILE", "compare your own traces with 3D: a COMSOL table, a CSV or other table, an ngspice file",
           (SINK, FREE), read=_data),
    Option("--column NAME=COLUMN ...", "the meaning of a column of that file, where its name does not show it: "
           'peak="T (K), Point 1", "end rise (K)=3", drive.voltage=Va', (SINK, FREE),
           needs=["--against"], keyword="columns"),
    Option("--data-uncertainty U ...", 'the standard uncertainty of the data: 0.5K, 1%%, peak=0.5K or peak="a column"',
           (SINK, FREE), needs=["--against"]),
    Option("--calibrate KEY ...", "fit a key to that data in 3D, as often as needed, and go on with what is fitted",
           (SINK, FREE), needs=["--against", "--data-uncertainty"]),
    Option("--export DIR", "write a compact model of a few states with its error, and a device's controllers, to "
           "DIR: JSON, Python, SPICE, FMU", read=_export, in_name="",
           excludes=["--only 1d", "--scheme paper", "--meter"]),
    Option("--states N", "with --export, how many states the model has (default: as few as --model-accuracy takes)",
           needs=["--export"], excludes=["--model-accuracy"], in_name=""),
    Option("--model-accuracy A", "with --export, the relative accuracy of the model (default: twice the run's)",
           needs=["--export"], in_name=""),
    Option("--fields", "write the 3D temperature fields (fem3d.pvd with .vtu files)", (SINK, FREE),
           excludes=["--only 1d"]),
    Option("--field-times T,T...", "with --fields, times to store beside the usual ones: 0.1ms,2ms", (SINK,),
           read=_times, needs=["--fields"], excludes=["--steady"], in_name="{}", otherwise=()),
    Option("--out DIR", "the results folder; a run that is there is replaced", in_name="", keyword=""),
    Option("--no-figures", "no figures", in_name=""),
    Option("--explain", "print first what will be solved and what is skipped, and why; then run", in_name="",
           excludes=["--dry-run", "--quiet", "--json"], keyword=""),
    Option("--dry-run", "print that plan alone: nothing is solved or written", excludes=["--quiet", "--json"],
           in_name="", keyword=""),
    Option("--strict", "exit with 1 for any check not as declared (undeclared: expected to agree), or unresolved",
           in_name="", keyword=""),
    Option("--quiet", "print the answer and the verdict only, in one line", excludes=["--json"], in_name="",
           keyword=""),
    Option("--json", "print summary.json in place of the tables", in_name="", keyword=""),
)  # fmt: skip


def of_kind(kind: str) -> Iterator[Option]:
    """Yield the options of a kind of scene."""
    return (option for option in TABLE if kind in option.kinds)


class Options(SimpleNamespace):
    """Values by keyword (``options.steady``); options that are not given have their defaults."""

    def __init__(self, **values: Any) -> None:
        defaults = {option.key: option.default for option in TABLE} | {"command": "", "uncertain": None}
        if unknown := values.keys() - defaults.keys():
            raise TypeError(f"no option {', '.join(sorted(unknown))}")
        super().__init__(**defaults | values)

    def but(self, **changes: Any) -> "Options":
        """Return these options with some changed."""
        return Options(**vars(self) | changes)

    @property
    def follows_keys(self) -> bool:
        """Whether sensitivities are computed."""
        return bool(self.sensitivities or self.uncertain)


def check(kind: str, given: Given) -> None:
    """Raise SceneError for one option that needs or excludes another."""
    options = {option.name: option for option in of_kind(kind)}

    def said(flag: str) -> str:
        """The option as given, or empty."""
        name, _, wanted = flag.partition(" ")
        option = options.get(name)
        if option is None or not (value := given.get(option.key)) or (wanted and value != wanted):
            return ""
        return name if option.switch or option.repeats or callable(value) else f"{name} {printable(str(value))}"

    for option in options.values():
        if not (this := said(option.name)):
            continue
        if other := next(filter(None, map(said, option.excludes)), ""):
            raise SceneError(f"{this} does not go with {other}: leave out {other}")
        if missing := next((flag for flag in option.needs if not said(flag)), ""):
            raise SceneError(f"{this} needs {missing}: give {missing}, too")


def settings(kind: str, given: Given, overrides: Sequence[str]) -> list[str]:
    """Return the overrides with the keys that options stand for. SceneError where two set one key."""
    made = list(overrides)
    for option in of_kind(kind):
        value = given.get(option.key)
        if not option.sets or value in (None, False) or (option.name == "--steady" and kind != FREE):
            continue
        key = option.sets + ("_3d" if option.name == "--accuracy" and given.get("in_3d") else "")
        text = "true" if value is True else value
        for setting in overrides:
            name, _, inner = (part.strip() for part in setting.partition("="))
            if f".{key}".endswith(f".{name}") or key.removeprefix(f"{name}.") in inner:
                raise SceneError(
                    f"{option.name} {text} and --set {printable(setting)} both set {key}: give one of them"
                )
        made.append(f"{key}={text}")
    return made


def read(kind: str, given: Given, scene: Any, command: str = "") -> Options:
    """Return the values of the given options, in the order of the table. Raises SceneError."""
    values: dict[str, Any] = {"command": command}
    for option in of_kind(kind):
        value = given.get(option.key)
        if value in (None, ()) or value == [] or option.name in ("--set", "--out"):
            continue
        if option.read is not None:
            value = option.read(value, scene, given)
        elif option.repeats:
            value = tuple(value)
        values |= value if isinstance(value, dict) else {option.key: value}
    return Options(**values)
