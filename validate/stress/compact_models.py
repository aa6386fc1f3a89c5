"""What compact models of random scenes say of their error, against finer runs of the full model."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from compare.processes import TimeIsUpError, limited
from validate.stress.report import Row

GROUP = "compact models"
ACCURACY, FINER = 3e-2, 0.2  # of a model, and the part of that to which the run is solved that it is held against
COUNT, QUICK = 50, 3
LIMIT = 60  # s of computing, after which a scene is left


def rows(quick: bool, first: int = 0) -> Iterator[Row]:
    """The worst of some models, made of scenes from a seed on, those left out for which no model of that accuracy is
    found in time; and how many ended with an error."""
    from scenes.errors import NumericsError, SceneError

    wanted = QUICK if quick else COUNT
    distances: dict[int, float] = {}
    refused, late, failed, seed = 0, 0, "", first
    while len(distances) < wanted and seed < first + 4 * wanted:
        try:
            with limited(LIMIT):
                distances[seed] = off(seed)
        except (NumericsError, SceneError):
            refused += 1
        except TimeIsUpError:
            late += 1
        except Exception as error:
            failed = failed or f"seed {seed}: {type(error).__name__}: {error}"
        seed += 1
    scenes = f"{len(distances)} scenes, seeds {first} to {seed - 1}"
    worst = max(distances, key=lambda s: (distances[s] != distances[s], distances[s]), default=first)
    said = f"worst: seed {worst}; none made of {refused} more, and of {late} not within {LIMIT} s"
    yield Row(GROUP, "distance from the full model", scenes, "over what is stated", distances.get(worst, np.nan), 1.0,
              said=said)  # fmt: skip
    yield Row(GROUP, "ended with an error", scenes, "scenes", float(bool(failed)), 0, said=failed)


def off(seed: int) -> float:
    """The largest distance of the model of a seed's scene from a finer run, over the errors that both state. Raises
    SceneError and NumericsError where there is no model."""
    from fem3d.compact.find import compact, instants
    from fem3d.runs.scene import solve
    from statespace.runtime import CompactModel
    from validate.stress.random_scenes import draw

    scene = draw(seed).scene
    document = compact(replace(scene, accuracy=ACCURACY), None, ACCURACY)
    model, truth = CompactModel(document), solve(replace(scene, accuracy=FINER * ACCURACY))
    ((_, stated), *_) = document["error"].items()
    each = []
    if scene.steady:
        ours = model.steady()
        each += [abs(ours[n] - is_.value) / (stated["steady"][n]["error"] + is_.error)
                 for n, is_ in truth.steady.items()]  # fmt: skip
    else:
        assert truth.traces is not None
        at = instants(scene, truth.traces.time)
        for n, values in model.simulate(truth.traces.time[at]).items():
            apart = np.abs(values - truth.traces.values[n][at]).max()
            each.append(float(apart) / (stated["over time"][n]["error"] + truth.traces.errors[n]))
    return max(each)
