"""The sink's steady state by a second, independent code: NGSolve (https://ngsolve.org), an optional extra.

A quarter of the sink on hexahedra of its own, graded towards the corners by hand, at two orders; the electrodes are the
beam's end cross sections, the middle of the beam is at half the voltage. Only the numbers of the scene are shared.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from typing import Any

import numpy as np

from scenes.sink import Sink
from validate.verify.answers import Row, skipped

FAMILY, CASE = "second code", "the sink at 1 V, steady"
ORDERS = (3, 4)
RATIO, SHORTEST = 0.2, 0.05  # grading towards the planes where boxes end; the shortest interval over the widest
PICARD, SETTLED = 30, 1e-11
ACCURACY = 1e-4

UNITS = {"peak_rise_K": "K", "end_rise_K": "K", "mean_rise_K": "K", "current_A": "A", "power_W": "W",
         "heat_out_W": "W", "anchor_resistance_K_per_W": "K/W"}  # fmt: skip
NAMES = {"peak_rise_K": "peak rise", "end_rise_K": "end rise", "mean_rise_K": "mean rise", "current_A": "current",
         "power_W": "power", "heat_out_W": "heat to the substrate",
         "anchor_resistance_K_per_W": "anchor resistance"}  # fmt: skip


def sink_steady() -> Iterator[Row]:
    """This project's sink against NGSolve's, each with its estimated error; a skipped row where it isn't installed."""
    try:
        import ngsolve
    except ImportError:
        yield skipped(FAMILY, CASE, "NGSolve is not installed: pip install 'heated-microstructure-validation[ngsolve]'")
        return
    from dataclasses import replace

    from fem3d.run import solve
    from scenes.plan import Request

    sink = Sink()
    ours = solve(replace(sink, accuracy=ACCURACY), Request(transient=False)).steady
    lower, higher = (by_ngsolve(sink, order) for order in ORDERS)
    note = f"NGSolve {ngsolve.__version__}, orders {ORDERS[0]} and {ORDERS[1]}"
    for name, value in higher.items():
        theirs = abs(value - lower[name])
        yield Row(FAMILY, CASE, NAMES[name], UNITS[name], value, ours[name].value, ours[name].error + theirs,
                  2 * ACCURACY * abs(value), note)  # fmt: skip


def by_ngsolve(sink: Sink, order: int) -> dict[str, float]:
    """The steady quantities of a whole sink with electrodes at the beam's ends and no air, in NGSolve at an order."""
    import ngsolve as ng

    mesh = _mesh(sink)
    with ng.TaskManager():
        heat = ng.H1(mesh, order=order, dirichlet="substrate")
        current = ng.H1(mesh, order=order, dirichlet="electrode|middle", definedon="beam")
        t, w = heat.TnT()
        phi, psi = current.TnT()
        k = mesh.MaterialCF({
            "beam": sink.silicon.thermal_conductivity, "pad": sink.silicon.thermal_conductivity,
            "oxide": sink.oxide.thermal_conductivity,
        })  # fmt: skip
        conduction = ng.BilinearForm(k * ng.grad(t) * ng.grad(w) * ng.dx).Assemble()
        inverse = conduction.mat.Inverse(heat.FreeDofs(), inverse="sparsecholesky")
        rise, potential = ng.GridFunction(heat), ng.GridFunction(current)
        held = mesh.BoundaryCF({"electrode": sink.voltage, "middle": sink.voltage / 2})
        potential.Set(held, definedon=mesh.Boundaries("electrode|middle"))
        assert sink.silicon.resistivity is not None
        rho, a = sink.silicon.resistivity, sink.silicon.temperature_coefficient
        hotter = sink.room_temperature - sink.silicon.reference_temperature
        sigma = 1 / (rho * (1 + a * (rise + hotter)))
        for _ in range(PICARD):
            flow = ng.BilinearForm(sigma * ng.grad(phi) * ng.grad(psi) * ng.dx("beam")).Assemble()
            residual = (-flow.mat * potential.vec).Evaluate()
            potential.vec.data += flow.mat.Inverse(current.FreeDofs(), inverse="sparsecholesky") * residual
            joule = sigma * ng.grad(potential) * ng.grad(potential)
            load = ng.LinearForm(joule * w * ng.dx("beam")).Assemble()
            before = rise.vec.CreateVector()
            before.data = rise.vec
            rise.vec.data = inverse * load.vec
            if (rise.vec - before).Evaluate().Norm() < SETTLED * rise.vec.Norm():
                break
        power = 4 * float(ng.Integrate(joule * ng.dx("beam"), mesh))
        # The heat that leaves is the residual of the equation tested with a function that is 1 on the substrate.
        test = ng.GridFunction(heat)
        test.Set(ng.CoefficientFunction(1.0), definedon=mesh.Boundaries("substrate"))
        reaction = (load.vec - conduction.mat * rise.vec).Evaluate()
        out = 4 * float(ng.InnerProduct(reaction, test.vec))
        area = float(ng.Integrate(ng.CoefficientFunction(1.0) * ng.ds("electrode"), mesh))
        end = float(ng.Integrate(rise * ng.ds("electrode"), mesh)) / area
        volume = sink.length * sink.cross_section / 4
        mean = float(ng.Integrate(rise * ng.dx("beam"), mesh)) / volume
        peak = float(rise(mesh(0.0, sink.length / 2, sink.thickness / 2)))
    return {
        "peak_rise_K": peak, "end_rise_K": end, "mean_rise_K": mean, "current_A": power / sink.voltage,
        "power_W": power, "heat_out_W": out, "anchor_resistance_K_per_W": end / (out / 2),
    }  # fmt: skip


def _mesh(sink: Sink) -> Any:
    """Hexahedra of the quarter x > 0, y < length/2, with materials and named faces, as NGSolve's mesh."""
    from netgen.meshing import Element2D, Element3D, FaceDescriptor, MeshPoint, Pnt
    from netgen.meshing import Mesh as NetgenMesh
    from ngsolve import Mesh

    half, pad = sink.width / 2, sink.pad_width / 2
    near, far = -sink.anchor_distance, -sink.anchor_distance - sink.oxide_length
    x = _graded([0.0, sink.oxide_width / 2, half, pad], (1, 2))
    y = _graded([-sink.pad_length, far, near, 0.0, sink.length / 2], (1, 2, 3))
    z = np.array([-sink.oxide_thickness, 0.0, sink.thickness])
    names = ["beam", "pad", "oxide"]
    raw = NetgenMesh()
    raw.dim = 3
    faces = {"substrate": 1, "electrode": 2, "middle": 3}
    for name, number in faces.items():
        raw.Add(FaceDescriptor(surfnr=number, domin=1, bc=number))
        raw.SetBCName(number - 1, name)
    points: dict[tuple[int, int, int], Any] = {}

    def node(i: int, j: int, k: int) -> Any:
        if (i, j, k) not in points:
            points[i, j, k] = raw.Add(MeshPoint(Pnt(x[i], y[j], z[k])))
        return points[i, j, k]

    def quad(corners: list[tuple[int, int, int]], name: str) -> None:
        raw.Add(Element2D(faces[name], [node(*c) for c in corners]))

    for i, (a, b) in enumerate(pairwise(x)):
        for j, (c, d) in enumerate(pairwise(y)):
            for k, (e, f) in enumerate(pairwise(z)):
                across, along, up = (a + b) / 2, (c + d) / 2, (e + f) / 2
                if up < 0:
                    inside = across < sink.oxide_width / 2 and far < along < near
                    material = "oxide"
                else:
                    inside = along < 0 or across < half
                    material = "pad" if along < 0 else "beam"
                if not inside:
                    continue
                low = [(i, j, k), (i, j, k + 1), (i, j + 1, k + 1), (i, j + 1, k)]
                element = Element3D(
                    names.index(material) + 1, [node(*c) for c in low] + [node(q + 1, r, s) for q, r, s in low]
                )
                element.curved = False
                raw.Add(element)
                if material == "oxide" and k == 0:
                    quad([(i, j, 0), (i, j + 1, 0), (i + 1, j + 1, 0), (i + 1, j, 0)], "substrate")
                if material == "beam" and c == 0.0:
                    quad([(i, j, k), (i + 1, j, k), (i + 1, j, k + 1), (i, j, k + 1)], "electrode")
                if material == "beam" and j == len(y) - 2:
                    quad([(i, j + 1, k), (i, j + 1, k + 1), (i + 1, j + 1, k + 1), (i + 1, j + 1, k)], "middle")
    for number, name in enumerate(names, start=1):
        raw.SetMaterial(number, name)
    return Mesh(raw)


def _graded(planes: list[float], towards: tuple[int, ...]) -> np.ndarray:
    """The planes, and between them intervals that shrink towards those with the given numbers."""
    widest = max(abs(b - a) for a, b in pairwise(planes[:4]))
    found = [planes[0]]
    for n, (a, b) in enumerate(pairwise(planes)):
        left, right = n in towards, n + 1 in towards
        inner = []
        if left and right:
            inner.append((a + b) / 2)
        elif b - a > 4 * widest:
            inner += [a + widest, a + 3 * widest] if left else [b - 3 * widest, b - widest]
        first = inner[0] if inner else b
        last = inner[-1] if inner else a
        below: list[float] = []
        above: list[float] = []
        while left and first - a > SHORTEST * widest:
            first = a + RATIO * (first - a)
            below.insert(0, first)
        while right and b - last > SHORTEST * widest:
            last = b - RATIO * (b - last)
            above.append(last)
        found += [*below, *inner, *above, b]
    return np.array(sorted(set(found)))
