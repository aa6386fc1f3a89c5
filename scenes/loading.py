"""Reading scenes: built-in or from a TOML file, with overrides, checked; writing the parametric ones back; and what
distinguishes one from the built-in one, in a few words that are safe in the name of a folder."""

from __future__ import annotations

import re
import shlex
import zlib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from functools import cache
from itertools import islice
from operator import attrgetter
from pathlib import Path
from typing import Any, Literal, TypeVar, overload

from scenes.device import Device
from scenes.errors import SceneError, did_you_mean, quoted, reason
from scenes.files import contents, parsed
from scenes.keys import DEVICE, SINK, TYPES, SceneType, type_of
from scenes.kinds import Choice
from scenes.model import AnyScene
from scenes.moved import transferred
from scenes.parameters import SECTION, Parameters
from scenes.schema import CONDUCTIVITY, nest, override, twin
from scenes.sink import Sink
from scenes.validity import check as check

T = TypeVar("T")
_EXPECTED = "checks.expect_differs"
_LONGEST = 80  # Characters of the part of a folder's name that tells a scene apart; longer ones end in a hash.
_LARGEST, _MOST_TABLES = 1, 10_000
"""MB of a scene file, and tables ([...] or [[...]]) in it, at most: what has more takes seconds to read and to refuse.
The most boxes that are solved, with a material and a contact for each, are 0.5 MB in 6,000 tables."""
_BOX = re.compile(r"^[ \t]*\[\[[ \t]*box[ \t]*\]\]", re.MULTILINE)
_TABLE = re.compile(r"^[ \t]*\[", re.MULTILINE)
_HERE = Path(__file__).parent


@overload
def load(source: Literal["sink"], overrides: Sequence[str] = ()) -> Sink: ...
@overload
def load(source: Literal["device"], overrides: Sequence[str] = ()) -> Device: ...
@overload
def load(source: str | Path, overrides: Sequence[str] = (), *, scene_type: SceneType[T]) -> T: ...
@overload
def load(source: str | Path, overrides: Sequence[str] = ()) -> Any: ...
def load(source: str | Path, overrides: Sequence[str] = (), *, scene_type: SceneType[Any] | None = None) -> Any:
    """The scene of a name ("sink", "device", "bridge", "plate", "hotplate") or a TOML file, with overrides such as
    "sink.width=20um" or "boundary.left.voltage=2" put over it, checked: a Sink, a Device or a free scene, whichever
    the file describes, or one of the ``scene_type``.

    What a file leaves out has its default, and a scene without a name is called after its file. The checks that a sink
    or a device expects to differ are a statement about that scene: an override of anything physical withdraws it
    (``expected_to_differ`` is then ``None``), unless an override says what is expected now. Raises SceneError.
    """
    content, name, folder = document(source, (scene_type.name,) if scene_type else known_names())
    if scene_type is not None:
        _check_kind(source, content, scene_type)
    scene_type = scene_type or type_of_file(content)
    if scene_type is None:
        from scenes import free

        return free.from_dict(content, name, folder, overrides)
    return _built({"scene.name": name} | scene_type.schema.flatten(content), overrides, scene_type)


def load_free(source: str | Path, overrides: Sequence[str] = ()) -> AnyScene:
    """The same of a free scene, an example or a file; the mesh of a [mesh] lies beside it and is not read."""
    from scenes import free

    content, name, folder = document(source, examples())
    _check_kind(source, content, None)
    return free.from_dict(content, name, folder, overrides)


def _check_kind(source: str | Path, content: Mapping[str, Any], scene_type: SceneType[Any] | None) -> None:
    """SceneError where a document is plainly of another type than this one, ``None`` being a free scene's; a sink's
    may become a device's by its overrides."""
    kind = type_of_file(content)
    if kind is None:
        wrong = scene_type is not None
    else:
        wrong = not says_nothing(content) and (scene_type is None or (scene_type is SINK and kind is DEVICE))
    if wrong:
        called, command = ("free scene", "solve") if kind is None else (f"{kind.name}'s scene", kind.name)
        raise SceneError(f"{quoted(Path(source))} is a {called}: validate {command} {shlex.quote(str(source))}")


def says_nothing(content: Mapping[str, Any]) -> bool:
    """Whether a document has nothing that tells its type: by default a sink, or a free scene without boxes."""
    from scenes.free.tables import BOXES, LISTS

    of_its_own = set(DEVICE.schema.sections[""]) - set(BOXES.sections[""])
    return not {*LISTS, "mesh", *of_its_own} & set(content)


def type_of_file(content: Mapping[str, Any]) -> SceneType[Any] | None:
    """Whether a document is of a sink or of a device; ``None`` for a free scene."""
    from scenes.free.tables import LISTS

    if {*LISTS, "mesh"} & set(content):
        return None
    of_a_device = {path for path in DEVICE.schema.sections if path and path not in SINK.schema.sections}
    materials = content.get("materials")
    named = {f"materials.{name}" for name in materials} if isinstance(materials, Mapping) else set()
    return DEVICE if of_a_device & (set(content) | named) else SINK


def overridden(scene: T, overrides: Sequence[str]) -> T:
    """A scene with "KEY=VALUE" overrides as `load` has them, checked; parameters move all. Raises SceneError."""
    changed: Any = scene
    if not overrides:
        return check(changed) if changed.kind in TYPES else changed
    if changed.parameters is None:
        return _read(changed, _flat(changed), overrides)
    flat = changed.parameters.flat
    after = _read(changed, flat, overrides)
    return replace(transferred(changed, _read(changed, flat, ()), after), parameters=after.parameters)  # type: ignore[no-any-return]


def _flat(scene: Any) -> dict[str, Any]:
    """What a file of the scene would say, by path."""
    if scene.kind in TYPES:
        return type_of(scene).schema.write(scene)
    from scenes import free

    return free.schema_of_scene(scene).flatten(free.as_dict(scene))


def _read(scene: Any, flat: Mapping[str, Any], overrides: Sequence[str]) -> Any:
    """What a flat scene says with overrides over it, as a scene of the kind of another."""
    if scene.kind in TYPES:
        return _built(flat, overrides, type_of(scene))
    from scenes import free

    return free.rebuilt(scene, override(flat, overrides, free.schema_of_scene(scene)))


def _built(flat: Mapping[str, Any], overrides: Sequence[str], scene_type: SceneType[Any]) -> Any:
    schema, parameters = scene_type.schema, {path: given for path, given in flat.items() if path == SECTION}
    before, values = schema.read(flat), schema.read(override(flat, overrides, schema))
    given = override(parameters, overrides, schema)
    if _physical(before, scene_type) != _physical(values, scene_type) and _EXPECTED not in given:
        values[_EXPECTED] = None
    scene = check(schema.apply(values, scene_type.default))
    refuse_unused(given, scene)
    return scene


def refuse_unused(paths: Iterable[str], scene: Any) -> None:
    """SceneError where one of the keys that were set, given by their paths, says nothing of what drives a sink or a
    device: a file may have them side by side, as the built-in ones do, who sets one means it."""
    by_controllers = scene.kind == Device.kind
    given = {path for path in paths if path.startswith("drive.")}
    for path in sorted(given if by_controllers else ()):
        raise SceneError(f"{path} says nothing of a device, whose controllers drive it: leave it out, or see [control]")
    if "drive.voltage" in given and scene.current is not None:
        raise SceneError(
            "drive.voltage says nothing of a sink that has a drive.current: give one of them, or drive.current = none"
        )


@overload
def from_dict(document: Mapping[str, Any]) -> Sink: ...
@overload
def from_dict(document: Mapping[str, Any], scene_type: SceneType[T]) -> T: ...
def from_dict(document: Mapping[str, Any], scene_type: SceneType[Any] = SINK) -> Any:
    """The scene of nested sections such as ``as_dict`` returns, checked; raises SceneError."""
    schema = scene_type.schema
    return check(schema.apply(schema.read(schema.flatten(document)), scene_type.default))


def as_dict(scene: object) -> dict[str, Any]:
    """Every key of a scene by section, as plain JSON types in SI units, what is made of parameters as numbers too;
    ``from_dict`` gives an equal scene back."""
    given: Parameters | None = getattr(scene, SECTION)
    return nest(type_of(scene).schema.write(scene)) | ({} if given is None else {SECTION: dict(given.values)})


def written(scene: Any) -> dict[str, Any]:
    """What a file of any scene would say, with its parameters and what is made of them where nothing else was changed
    since it was read: after that, numbers alone."""
    given: Parameters | None = scene.parameters
    if given is not None and _read(scene, given.flat, ()) == scene:
        return nest(given.flat)
    return nest(_flat(scene))


def known_names() -> tuple[str, ...]:
    """The names of the scenes that come with the toolkit, of the parametric ones first."""
    return (*TYPES, *examples())


@cache
def examples() -> tuple[str, ...]:
    """The names of the free scenes that come with the toolkit, to copy and edit."""
    return tuple(sorted(path.stem for path in _HERE.glob("examples/*.toml")))


def builtin_text(name: str) -> str:
    """A built-in scene as commented TOML, to copy and edit; raises SceneError for an unknown name."""
    known = known_names()
    if name not in known:
        raise SceneError(
            f"{quoted(name)} is not a built-in scene: give {' or '.join(known)}{did_you_mean(name, known)}"
        )
    return (_HERE / ("" if name in TYPES else "examples") / f"{name}.toml").read_text(encoding="utf-8")


def document(source: str | Path, known: Sequence[str]) -> tuple[dict[str, Any], str, str]:
    """What stands in a scene of those ``known`` by their names or in a file, a name for a scene that has none, and the
    folder that it lies in; raises SceneError."""
    if isinstance(source, str) and source in known:
        return toml(builtin_text(source), source), source, ""
    return toml(file_text(source, known), source), file_name(Path(source)), str(Path(source).parent)


def toml(text: str, source: str | Path) -> dict[str, Any]:
    """The document of a TOML text that came from somewhere; raises SceneError."""
    from scenes.free.document import check_number

    try:
        check_number(len(_BOX.findall(text)))  # before they are read, which takes seconds of 10,000
        if (tables := len(_TABLE.findall(text))) > _MOST_TABLES:
            raise SceneError(f"{tables:,} tables are more than any scene that is solved has: {_MOST_TABLES:,} at most")
        return parsed(text)
    except SceneError as error:
        raise SceneError(f"{quoted(Path(source))}: {error}") from None
    except (ValueError, RecursionError) as error:
        raise SceneError(f"{quoted(Path(source))} is not valid TOML: {reason(error)}") from None


def file_text(source: str | Path, known: Sequence[str]) -> str:
    """The text of a scene file; ``known`` are the built-in scenes that could be given instead. Raises SceneError."""
    shown, instead = quoted(Path(source)), " or ".join(known)
    try:
        # A byte order mark, which some editors write, is no part of the text.
        return contents(Path(source), _LARGEST, shown, "5,000 boxes fit into that, more than are solved").decode(
            "utf-8-sig"
        )
    except SceneError:
        raise
    except FileNotFoundError:
        if source in known_names():
            command = source if source in TYPES else f"solve {source}"
            raise SceneError(f"{shown} is a scene of another command: validate {command}") from None
        beside = map(str, islice(Path(source).parent.glob("*.toml"), 100))
        hint = did_you_mean(str(source), (*known, *beside))
        raise SceneError(f"{shown} is no file: give a TOML file, or the built-in {instead}{hint}") from None
    except IsADirectoryError:
        raise SceneError(f"{shown} is a directory: give a TOML file, or the built-in {instead}") from None
    except UnicodeDecodeError as error:
        raise SceneError(f"{shown} is not UTF-8 text (byte {error.start}): save the TOML file as UTF-8") from None
    except (OSError, ValueError) as error:
        raise SceneError(f"{shown} cannot be read: {reason(error)}") from None


def file_name(path: Path) -> str:
    """A name for a scene that has none: the file's, without what a name may not have."""
    return re.sub(r"[^\w .-]", "_", path.stem)[:60].strip(" .-") or "scene"


def _physical(values: Mapping[str, Any], scene_type: SceneType[Any]) -> dict[str, Any]:
    """What says what is solved, with a default standing for what is left out."""
    written = scene_type.schema.write(scene_type.schema.apply(values, scene_type.default))
    return {path: value for path, value in written.items() if scene_type.schema.paths[path].physical}


def distinguishes(scene: object) -> str:
    """The leading key (a sink's voltage, a device's final outer temperature), then every key that differs from its
    default: "1V", "2V-width20um", "1V-pad-edge", "273K".

    Different scenes get different texts, but for their name and checks, which are left out. A text longer than 80
    characters ends in a checksum of the whole instead. The values are taken as valid (``scenes.validity.check``).
    """
    kind = type_of(scene)
    words: list[str] = []
    # Of a resistivity and the conductivity that it is the inverse of, the conductivity is shown.
    shown = {path for path in kind.schema.write(scene) if path.endswith(CONDUCTIVITY)}
    for path, key in kind.schema.paths.items():
        value = attrgetter(key.attribute)(scene)
        section, _, name = path.rpartition(".")
        if section in ("scene", "checks"):
            continue
        given = path == "drive.current" and value is not None and kind.leading == SINK.leading
        if given or (path == kind.leading and getattr(scene, "current", None) is None):
            words.insert(0, _safe(key.kind.show(value)))
        elif path == kind.leading:
            continue
        elif value != attrgetter(key.attribute)(kind.default) and twin(path) not in shown:
            owned = section.startswith("materials.") or section == "substrate"
            owner = section.removeprefix("materials.") + "_" if owned else ""
            label = "" if isinstance(key.kind, Choice) else f"{owner}{name}"
            words.append(label + _safe(key.kind.show(value)))
    return shortened("-".join(words))


def shortened(text: str) -> str:
    """A text of at most 80 characters: a longer one ends in a checksum of the whole."""
    if len(text) <= _LONGEST:
        return text
    return f"{text[: _LONGEST - 9].rstrip('-.')}-{zlib.crc32(text.encode()):08x}"


def _safe(shown: str) -> str:
    """Without the spaces and signs of compound units: a number, and "20um" where the unit is one word; of a law all."""
    if " K" in shown.partition(" ")[2]:
        return re.sub(r"[^\w.+-]", "", shown)
    number, _, unit = shown.partition(" ")
    signed = re.sub("^-", "minus", number)
    return re.sub(r"[^\w.+-]", "", signed + (unit if unit.isalpha() else ""))
