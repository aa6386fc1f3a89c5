"""Read scenes, built-in or from TOML files, with overrides; write parametric scenes back; name their folders."""

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
from typing import Any, TypeVar

from scenes import free
from scenes.device import Device
from scenes.errors import SceneError, contents, did_you_mean, parsed, quoted, reason, unknown
from scenes.free.tables import BOXES, LISTS
from scenes.keys import DEVICE, SINK, TYPES, SceneType, type_of
from scenes.kinds import Choice
from scenes.model import AnyScene
from scenes.parameters import SECTION, Parameters, transferred
from scenes.schema import nest, override
from scenes.validity import check as check

T = TypeVar("T")
_EXPECTED = "checks.expect_differs"
_LONGEST = 80  # characters of a scene's part of a folder's name; a longer one ends in a hash
_HERE = Path(__file__).parent


def load(source: str | Path, overrides: Sequence[str] = (), *, scene_type: SceneType | None = None) -> Any:
    """Load a built-in scene ("sink", "device", "bridge", "plate", "hotplate") or a TOML file, with overrides, checked.

    The result is a Sink, a Device or a free scene, as the file describes, or one of the ``scene_type``. Overrides are
    texts such as "sink.width=20um" or "boundary.left.voltage=2". Missing keys have their defaults, and a scene without
    a name is called after its file. A physical override of a sink or a device withdraws its declaration of the checks
    that are expected to differ (``expected_to_differ`` is then ``None``), unless an override declares them again.
    Raises SceneError.
    """
    content, name, folder = document(source, (scene_type.name,) if scene_type else known_names())
    if scene_type is not None:
        _check_kind(source, content, scene_type)
    scene_type = scene_type or type_of_file(content)
    if scene_type is None:
        return free.from_dict(content, name, folder, overrides)
    return _built({"scene.name": name} | scene_type.schema.flatten(content), overrides, scene_type)


def load_free(source: str | Path, overrides: Sequence[str] = ()) -> AnyScene:
    """Load a free scene, an example or a file; the mesh of a [mesh] lies beside the file and is not read."""
    content, name, folder = document(source, examples())
    _check_kind(source, content, None)
    return free.from_dict(content, name, folder, overrides)


def _check_kind(source: str | Path, content: Mapping[str, Any], scene_type: SceneType | None) -> None:
    """Refuse a document that is plainly of another type, ``None`` being a free scene; overrides may make a device of a
    sink."""
    kind = type_of_file(content)
    fits = kind is scene_type or (kind is SINK and (scene_type is DEVICE or says_nothing(content)))
    if not fits:
        called, command = (f"{kind.name}'s scene", kind.name) if kind else ("free scene", "solve")
        raise SceneError(f"{quoted(Path(source))} is a {called}: validate {command} {shlex.quote(str(source))}")


def says_nothing(content: Mapping[str, Any]) -> bool:
    """Whether a document fits any type: a sink by default, or a free scene without boxes."""
    of_its_own = set(DEVICE.schema.sections[""]) - set(BOXES.sections[""])
    return not {*LISTS, "mesh", *of_its_own} & set(content)


def type_of_file(content: Mapping[str, Any]) -> SceneType | None:
    """Return the type of a document, ``None`` for a free scene."""
    if {*LISTS, "mesh"} & set(content):
        return None
    of_a_device = {path for path in DEVICE.schema.sections if path and path not in SINK.schema.sections}
    materials = content.get("materials")
    named = {f"materials.{name}" for name in materials} if isinstance(materials, Mapping) else set()
    return DEVICE if of_a_device & (set(content) | named) else SINK


def overridden(scene: T, overrides: Sequence[str]) -> T:
    """Return a scene with "KEY=VALUE" overrides, checked; a parameter moves everything made of it.

    Raises SceneError.
    """
    changed: Any = scene
    if changed.kind in TYPES:
        check(changed)
    else:  # a temperature behind a contact_resistance becomes a film, as in a file
        changed = replace(changed, boundaries=free.rebuilt(changed, _flat(changed)).boundaries)
    if not overrides:
        return changed
    flat = _flat(changed) if changed.parameters is None else changed.parameters.flat
    if changed.kind in TYPES:
        after = _built(flat, overrides, type_of(changed))
    else:
        after = free.rebuilt(changed, override(flat, overrides, free.schema_of_scene(changed)))
    return after if changed.parameters is None else moved(changed, after)  # type: ignore[no-any-return]


def moved(scene: Any, after: Any) -> Any:
    """Return a scene with all changes from the scene of its file to another with other parameters."""
    return replace(transferred(scene, rebuilt(scene, scene.parameters.flat), after), parameters=after.parameters)


def rebuilt(scene: Any, flat: Mapping[str, Any]) -> Any:
    """Return the scene of a flat one, of the kind of another scene; a free one is checked (SceneError)."""
    if scene.kind in TYPES:
        kind = type_of(scene)
        return kind.schema.apply(kind.schema.read(flat), kind.default)
    return free.rebuilt(scene, flat)


def _flat(scene: Any) -> dict[str, Any]:
    """The flat scene of a scene."""
    if scene.kind in TYPES:
        return type_of(scene).schema.write(scene)
    return free.schema_of_scene(scene).flatten(free.as_dict(scene))


def _built(flat: Mapping[str, Any], overrides: Sequence[str], scene_type: SceneType) -> Any:
    schema, parameters = scene_type.schema, {path: given for path, given in flat.items() if path == SECTION}
    before, values = schema.read(flat), schema.read(override(flat, overrides, schema))
    given = override(parameters, overrides, schema)
    if _physical(before, scene_type) != _physical(values, scene_type) and _EXPECTED not in given:
        values[_EXPECTED] = None
    scene = check(schema.apply(values, scene_type.default))
    refuse_unused(given, scene)
    return scene


def refuse_unused(paths: Iterable[str], scene: Any) -> None:
    """Refuse settings of drives, given by their paths, that have no effect on a sink or a device.

    A file may have them side by side, as the built-in scenes do.
    """
    by_controllers = scene.kind == Device.kind
    given = {path for path in paths if path.startswith("drive.")}
    for path in sorted(given if by_controllers else ()):
        raise SceneError(f"{path} says nothing of a device, whose controllers drive it: leave it out, or see [control]")
    if "drive.voltage" in given and scene.current is not None:
        raise SceneError("drive.voltage says nothing beside drive.current: give one of them, or drive.current = none")


def from_dict(document: Mapping[str, Any], scene_type: SceneType = SINK) -> Any:
    """Return the scene of nested sections as ``as_dict`` makes them, checked; raises SceneError."""
    schema = scene_type.schema
    return check(schema.apply(schema.read(schema.flatten(document)), scene_type.default))


def as_dict(scene: object) -> dict[str, Any]:
    """Return every key of a scene by section, as plain JSON types in SI units, without expressions.

    ``from_dict`` returns an equal scene.
    """
    given: Parameters | None = getattr(scene, SECTION)
    return nest(type_of(scene).schema.write(scene)) | ({} if given is None else {SECTION: dict(given.values)})


def written(scene: Any) -> dict[str, Any]:
    """Return the document of any scene, with expressions where the scene is as it was read, else with numbers."""
    given: Parameters | None = scene.parameters
    if given is not None and rebuilt(scene, given.flat) == scene:
        return nest(given.flat)
    return nest(_flat(scene))


def known_names() -> tuple[str, ...]:
    """Return the names of the built-in scenes, the parametric scenes first."""
    return (*TYPES, *examples())


@cache
def examples() -> tuple[str, ...]:
    """Return the names of the built-in free scenes."""
    return tuple(sorted(path.stem for path in _HERE.glob("examples/*.toml")))


def builtin_text(name: str) -> str:
    """Return a built-in scene as commented TOML, to copy and edit; raises SceneError for an unknown name."""
    if name not in known_names():
        raise unknown("there is no built-in scene", name, known_names())
    return (_HERE / ("" if name in TYPES else "examples") / f"{name}.toml").read_text(encoding="utf-8")


def document(source: str | Path, known: Sequence[str]) -> tuple[dict[str, Any], str, str]:
    """Return the document of a ``known`` built-in scene or of a file, a default name, and the file's folder.

    Raises SceneError.
    """
    if isinstance(source, str) and source in known:
        text, name, folder = builtin_text(source), source, ""
    else:
        text, name, folder = _file_text(source, known), file_name(Path(source)), str(Path(source).parent)
    try:
        return parsed(text), name, folder
    except SceneError as error:
        raise SceneError(f"{quoted(Path(source))}: {error}") from None
    except (ValueError, RecursionError) as error:
        raise SceneError(f"{quoted(Path(source))} is not valid TOML: {reason(error)}") from None


def _file_text(source: str | Path, known: Sequence[str]) -> str:
    """The text of a scene file; messages offer the ``known`` built-in scenes."""
    shown, offer = quoted(Path(source)), f"give a TOML file, or the built-in {' or '.join(known)}"
    try:
        # A byte order mark, which some editors write, is no part of the text.
        return contents(Path(source), 1, shown, "5,000 boxes fit into that, more than are solved").decode("utf-8-sig")
    except SceneError:
        raise
    except FileNotFoundError:
        if source in known_names():
            command = source if source in TYPES else f"solve {source}"
            raise SceneError(f"{shown} is a scene of another command: validate {command}") from None
        beside = map(str, islice(Path(source).parent.glob("*.toml"), 100))
        raise SceneError(f"{shown} is no file: {offer}{did_you_mean(str(source), (*known, *beside))}") from None
    except (OSError, ValueError) as error:
        raise SceneError(f"{shown} cannot be read as UTF-8 text ({reason(error)}): {offer}") from None


def file_name(path: Path) -> str:
    """Return the name of a scene after its file, without characters that a name may not have."""
    return re.sub(r"[^\w .-]", "_", path.stem)[:60].strip(" .-") or "scene"


def _physical(values: Mapping[str, Any], scene_type: SceneType) -> dict[str, Any]:
    """The flat scene of the physical keys, defaults included."""
    written = scene_type.schema.write(scene_type.schema.apply(values, scene_type.default))
    return {path: value for path, value in written.items() if scene_type.schema.paths[path].physical}


def distinguishes(scene: object) -> str:
    """Return the words of a scene in a folder's name: "1V", "2V-width20um", "1V-pad-edge", "273K".

    The leading key (a sink's voltage, a device's final outer temperature) comes first, then every key that differs from
    its default, but for name and checks. A text longer than 80 characters ends in a checksum of the whole.
    """
    kind, words = type_of(scene), list[str]()
    by_current = kind.leading == SINK.leading and getattr(scene, "current", None) is not None
    leading = "drive.current" if by_current else kind.leading
    default = kind.schema.write(kind.default)
    for path, value in kind.schema.write(scene).items():
        key = kind.schema.paths[path]
        shown = _safe(key.kind.show(attrgetter(key.attribute)(scene)))
        section, _, name = path.rpartition(".")
        if path == leading:
            words.insert(0, shown)
        elif section not in ("scene", "checks") and path != kind.leading and value != default.get(path):
            owned = section.startswith("materials.") or section == "substrate"
            owner = section.removeprefix("materials.") + "_" if owned else ""
            words.append(shown if isinstance(key.kind, Choice) else f"{owner}{name}{shown}")
    return shortened("-".join(words))


def shortened(text: str) -> str:
    """Shorten a text to 80 characters, the end being a checksum of the whole."""
    if len(text) <= _LONGEST:
        return text
    return f"{text[: _LONGEST - 9].rstrip('-.')}-{zlib.crc32(text.encode()):08x}"


def _safe(shown: str) -> str:
    """A shown value without spaces and signs: a number, "20um" for a unit of one word, or a whole law."""
    if " K" in shown.partition(" ")[2]:
        return re.sub(r"[^\w.+-]", "", shown)
    number, _, unit = shown.partition(" ")
    signed = re.sub("^-", "minus", number)
    return re.sub(r"[^\w.+-]", "", signed + (unit if unit.isalpha() else ""))
