"""Remarks on the structure of a scene: bodies, narrow gaps, overlaps, cuts."""

import copy
from typing import Any

import pytest

from scenes.errors import SceneError
from scenes.free import from_dict
from scenes.free.structure import described, remarks
from scenes.model import Scene
from tests.scenes.free.refused import beam, flat

Document = dict[str, Any]


def lines(document: Document) -> dict[str, str]:
    return dict(described(scene(document)))


def scene(document: Document) -> Scene:
    return from_dict(copy.deepcopy(document))


def roof(gap: float, **more: Any) -> Document:
    """The beam, 1 m thick, with a slab of metal above, held at its own temperature."""
    document = beam()
    document["box"].append(
        {"name": "roof", "material": "metal", "lower": [0, 0, 1 + gap], "upper": [4, 1, 1.5 + gap], **more}
    )
    document["boundary"] += [
        flat("sky", [0, 0, 1.5 + gap], [4, 1, 1.5 + gap], temperature=300),
        flat("near", [0, 0, 1 + gap], [0, 1, 1.5 + gap], voltage=1),
    ]
    return document


def test_one_body():
    document = beam()
    document["boundary"][0]["upper"] = [3, 1, -1]
    found = lines(document)
    assert found["bodies"] == 'one: "beam" and "foot"'
    assert {"gap", "overlaps"}.isdisjoint(found)
    assert remarks(scene(document)) == []


@pytest.mark.parametrize("gap", [1e-3, 0.0499])
def test_two_bodies_that_nearly_touch_are_said(gap):
    """The thinner one is 0.5 m thick; the limit is a tenth."""
    document = roof(gap)
    assert lines(document)["bodies"] == '2 that nothing passes between: "beam" and "foot"; "roof"'
    assert 'boxes "beam" and "roof" are ' in lines(document)["gap"]
    assert "apart along z, where the thinner one has 500 mm" in lines(document)["gap"]
    bodies, gap_said = remarks(scene(document))
    assert bodies.startswith("bodies: 2 that")
    assert gap_said == f"gap: {lines(document)['gap']}"


def test_a_wide_gap_is_no_slip_and_bodies_that_touch_are_one():
    assert "gap" not in lines(roof(0.0501))
    assert lines(roof(0.0501))["bodies"].startswith("2 ")
    document = roof(0.0)
    document["boundary"].pop()  # a second electrode on the beam's own faces
    assert lines(document)["bodies"] == 'one: "beam", "foot" and "roof"'


@pytest.mark.parametrize(
    ("aside", "above", "said"), [(0.02, 0.01, "22.4 mm"), (0.0, 0.01, "10.0 mm"), (0.41, 0.01, "")]
)
def test_bodies_that_lie_diagonally_at_a_narrow_gap_are_said(aside, above, said):
    """No axis passes through both."""
    document = roof(above)
    document["box"][-1] |= {"lower": [4 + aside, 0, 1 + above], "upper": [8, 1, 1.5 + above]}
    document["boundary"] = document["boundary"][:-2]
    document["boundary"].append(flat("sky", [4 + aside, 0, 1.5 + above], [8, 1, 1.5 + above], temperature=300))
    found = [text for text in remarks(scene(document)) if "diagonally" in text]
    assert len(found) == bool(said)
    assert all(f'"beam" and "roof" lie diagonally at {said} from one another' in text for text in found)
    # One body gets no remark: heat goes another way.
    document["box"].append({"name": "post", "material": "metal", "lower": [3, 0, 0], "upper": [5, 1, 1.5 + above]})
    assert not [text for text in remarks(scene(document)) if "diagonally" in text]


def test_what_a_box_loses_to_a_later_one_is_said():
    document = beam()
    intruder = {"name": "intruder", "material": "oxide", "lower": [1, 0, 0.5], "upper": [3, 1, 1]}
    document["box"].append(intruder)
    assert lines(document)["overlaps"] == 'the later box wins: "beam" loses 25 % to "intruder"'
    assert remarks(scene(document)) == ['overlaps: the later box wins: "beam" loses 25 % to "intruder"']
    # One of the same material takes nothing.
    document["box"][-1] = {**intruder, "material": "metal"}
    assert remarks(scene(document)) == []


def wall(document: Document) -> Document:
    document["box"].append({"name": "wall", "material": "oxide", "lower": [1, 0, 0], "upper": [1.5, 1, 1]})
    return document


def test_an_insulating_box_across_a_beam_cuts_the_current():
    with pytest.raises(SceneError, match="no voltage across a conductor"):
        from_dict(wall(beam()))
    document = wall(beam())
    document["boundary"][0]["temperature"] = 300
    found = scene(document)
    assert remarks(found)[-1] == "current: no current passes, for no conductor joins electrodes of different voltages"
    # One that leaves a way round does not cut it.
    document["box"][-1]["upper"] = [1.5, 0.5, 1]
    assert "no current" not in " ".join(remarks(scene(document)))
