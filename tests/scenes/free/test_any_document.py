"""Whatever stands in a file, it is a scene or a sentence; and the sink is a free scene as well."""

from __future__ import annotations

import copy
import tomllib
from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from scenes.errors import SceneError
from scenes.free import as_dict, check, from_dict, load
from scenes.free.document import as_toml
from scenes.sink import Sink

ODD = st.one_of(
    st.none(), st.booleans(), st.integers(-3, 3), st.floats(), st.text(max_size=6), st.just([]), st.just({}),
    st.sampled_from(["1 um", "20 degC", "1e400 V", "beam", "oxide", "mean", "max", "heat_flow", "current"]),
    st.lists(st.sampled_from([0, 2e-6, 1e-5, "3 um", None, float("nan")]), min_size=3, max_size=3),
    st.just({"times": [0, 0, 1], "values": [0, 1, 2]}), st.just({"coefficient": 1, "ambient": 300}),
)  # fmt: skip
KEYS = ("name", "material", "lower", "upper", "at", "voltage", "temperature", "heat_flux", "convection", "heat_source",
        "quantity", "reduce", "resistivity", "density", "steady", "end_time", "output_times", "accuracy")  # fmt: skip
CHANGE = st.tuples(
    st.sampled_from(("scene", "run", "material", "box", "boundary", "probe")), st.integers(0, 3), st.sampled_from(KEYS),
    ODD,
)  # fmt: skip
BRIDGE = as_dict(load("bridge"))


@settings(max_examples=80, deadline=None)
@given(st.lists(CHANGE, min_size=1, max_size=4))
def test_every_document_is_a_scene_or_is_refused_in_one_line(changes: list) -> None:
    document = copy.deepcopy(BRIDGE)
    for table, number, key, value in changes:
        items = document[table]
        (items[number % len(items)] if isinstance(items, list) else items)[key] = value
    message = ""
    try:
        scene = from_dict(document)
    except SceneError as error:
        message = str(error)
    else:
        assert from_dict(as_dict(scene)) == scene
    assert message.isprintable()
    assert len(message) < 400


SINKS = [
    Sink(), Sink(electrodes="pad-edge"), Sink(convection_coefficient=10.0), Sink(width=400e-6),
    Sink(oxide_offset=0.0), Sink(oxide_thickness=20e-9),
]  # fmt: skip


@pytest.mark.parametrize("sink", SINKS)
def test_the_sink_is_a_free_scene(sink: Sink) -> None:
    scene = check(sink.scene())
    assert from_dict(as_dict(scene)) == scene
    assert from_dict(tomllib.loads(as_toml(scene))) == scene
    assert check(replace(scene, steady=True)).steady


def test_a_sink_without_its_substrate_is_not() -> None:
    scene = replace(Sink().scene(), steady=True)
    with pytest.raises(SceneError, match="no exit for heat"):
        check(replace(scene, boundaries=tuple(b for b in scene.boundaries if b.kind == "voltage")))
