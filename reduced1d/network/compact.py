"""A network as a compact model: projected on a few fields, its currents on the few patterns that they have, with the
error of that against the network itself."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from reduced1d.network.circuit import factor
from reduced1d.network.lines import Layout, layout
from reduced1d.network.model import Model
from reduced1d.network.readings import Reader
from reduced1d.network.solution import BELOW, EARLY, magnitudes, refined, solve
from reduced1d.network.solvers import steady
from scenes import physics
from scenes.errors import SceneError
from scenes.model import DERIVED, AnyScene, Probe
from scenes.model import UNITS as OF_PROBES
from statespace.channels import OWN, UNITS, Channel, channels, scenarios
from statespace.document import scene_document
from statespace.reduction import Reference, Row, StateSpace, Times, krylov_fields, reduce


def compact(
    scene: AnyScene, states: int | None, accuracy: float, say: Callable[[str], None] = lambda _: None
) -> dict[str, Any]:
    """Make the document of a network's compact model; arguments, result and errors as of `fem3d.runs.compact`."""
    physics.refuse_terminals(scene, "a network's compact model")
    untyped: Any = scene
    shape = layout(replace(untyped, probes=tuple(p for p in untyped.probes if p.quantity not in DERIVED)))
    scene = shape.scene
    if any(p.reduce != "mean" for p in scene.probes):
        raise SceneError('a network\'s compact model has no extremes: give its probes reduce = "mean", or points')
    if not physics.heat(scene):
        raise SceneError("a network is exported with its heat, and nothing thermal is asked for: add a temperature")
    model = refined(shape, 0)[1] if scene.steady else refined(shape, 0, 0.1 * EARLY * scene.end_time)[1]
    references, inputs = dict[str, list[Reference]](), channels(scene)
    for name, other in scenarios(scene, inputs).items():
        say(f"compact model: {name}")
        own = references[OWN][0].scales if references else {}
        references[name] = [_reference(replace(shape, scene=other), inputs, own)]  # type: ignore[arg-type]
    times = None if scene.steady else (EARLY * scene.end_time, scene.end_time)
    space = _Projection(model, times, BELOW * accuracy).state_space()
    order = space.leading(np.array([c.step for c in inputs]), np.array([c.rest for c in inputs]), times)

    def document(count: int) -> dict[str, Any]:
        name = f"{scene.name}, the network of its boxes"
        return scene_document(scene, name, inputs, space.within(order[:, :count]), 10 * EARLY * scene.end_time)

    made = reduce(document, space.states, references, accuracy, states, "the network")
    text = ["Estimated: the distance from the network of lines itself for each of these inputs, with its own error."]
    return made | {"estimated": {"runs": len(references), "text": text}}


def _reference(shape: Layout, inputs: tuple[Channel, ...], own: Mapping[str, float]) -> Reference:
    """Solve the network of a scenario; scales are at least a hundredth of the ``own`` ones of the scene itself."""
    scene = shape.scene
    values = {c.name: c.value for c in channels(scene)}
    start = {p.name: scene.initial_temperature for p in scene.probes if p.quantity == "temperature"}
    times = None if scene.steady else np.geomspace(10 * EARLY, 1, 40) * scene.end_time
    run = Reference.of_result({c.name: values.get(c.name, 0.0) for c in inputs}, solve(shape, times, False), {})
    rises = {n: np.atleast_1d(v) - start.get(n, 0.0) for n, v in run.values.items()}
    return replace(run, scales={n: max(s, 0.01 * own.get(n, 0.0)) for n, s in magnitudes(shape, rises).items()})


class _Projection:
    """A network on a few ``fields`` (f, n): z = (1, inputs as rises, states).

    ``patterns`` (p, flows) are the independent currents, as flows of ``electric``, the reader of the current.
    """

    def __init__(self, model: Model, times: Times, enough: float) -> None:
        assert model.heat is not None
        self.model, self.heat, self.scene = model, model.heat, model.layout.scene
        self.channels = channels(self.scene)
        names = [b.name for b in self.scene.boundaries]
        self.columns = [model.inputs.sources[c.item] if c.kind == "heat_source" else names.index(c.item)
                        for c in self.channels]  # fmt: skip
        free = self.heat.free
        self.K = (free.T @ model.stiffness @ free).tocsc()
        self.C = (free.T @ model.capacity @ free).tocsc() if times else self.K
        self.lifted = (free.T @ model.capacity @ self.heat.fixed).toarray()[:, self.columns] * bool(times)
        self.entering = (free.T @ (model.entering - model.stiffness @ self.heat.fixed)).toarray()[:, self.columns]
        measured = {q: tuple(p for p in self.scene.probes if p.quantity == q) for q in ("heat_flow", "current")}
        self.thermal = Reader(model, False, measured["heat_flow"])
        self.electric = Reader(model, True, measured["current"]) if model.current else None
        self.patterns = self._patterns()
        self.pairs = [(i, j) for i in range(len(self.patterns)) for j in range(i, len(self.patterns))]
        V = krylov_fields(self.C, self.K, self._solver, self._loads(), times, enough)
        # (unknowns, z) and (inputs, z): rises and inputs as affine maps of z.
        fixed = self.heat.fixed.toarray()[:, self.columns]
        self.V, self.rise = V, np.hstack([np.zeros((len(fixed), 1)), fixed, free @ V])
        self.given = np.zeros((len(model.inputs.values), self.rise.shape[1]))
        self.given[self.columns, 1 + np.arange(len(self.columns))] = 1.0

    def _patterns(self) -> np.ndarray:
        """The independent currents of a volt at each electrode, cold and as it is at last."""
        model = self.model
        if self.electric is None:
            return np.empty((0, 0))
        states = [np.zeros(model.elements.size), *([steady(model)[0][:, 0]] if model.couples else [])]
        volts = np.eye(len(model.inputs.values))[:, model.inputs.electric]
        currents = []
        for rise in states:
            rises = np.repeat(rise[:, None], volts.shape[1], axis=1)
            currents.append(self.electric.flows(rises, model.potentials(rises, volts), volts))
        flows = np.hstack(currents)[: -len(volts)]
        modes, sizes, _ = np.linalg.svd(flows, full_matrices=False)
        return np.asarray((modes[:, sizes > 1e-7 * sizes[0]] * sizes[0]).T)

    def _halved(self, one: np.ndarray, other: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(h,) twice: the product of two flows with the resistance of each half, cold, and its change per kelvin."""
        circuit, law = self.model.current, self.model.law
        assert circuit is not None
        product = one[circuit.branch] * other[circuit.branch] * circuit.size
        return product * law[0], product * law[1]

    def _solver(self, shift: float) -> Callable[[np.ndarray], np.ndarray]:
        if np.isfinite(shift):
            return factor(self.C + shift * self.K).solve  # type: ignore[no-any-return]
        # Without an exit for heat, the response after the whole run stands for the steady one.
        return factor(self.K + self.C / self.scene.end_time if self.heat.floats else self.K).solve  # type: ignore

    def _loads(self) -> list[np.ndarray]:
        """The loads of inputs, of their jumps, and of the Joule heat of each pair of patterns."""
        loads = [*self.entering.T, *self.lifted.T]
        for i, j in self.pairs:
            halves = (self.model.current.halves @ self.heat.free).tocsr()  # type: ignore[union-attr]
            cold, warm = self._halved(self.patterns[i], self.patterns[j])
            load = halves.T @ cold
            # Heating follows the temperature: the heat of responses to heat, and so on four times, as each shrinks the
            # remainder by the feedback's share.
            for _ in range(5 if self.model.couples else 1):
                loads.append(load)
                load = halves.T @ (warm * (halves @ self._solver(np.inf)(load)))
        return [load for load in loads if load.any()]

    def state_space(self) -> StateSpace:
        V, m, (_, z) = self.V, len(self.patterns), self.rise.shape
        n, inputs = V.shape[1], len(self.channels)
        A, Q, S = np.zeros((m, m, z)), np.zeros((len(self.pairs), n, z)), np.zeros((m, z))
        for p, (i, j) in enumerate(self.pairs):
            by_z = self._along_z(*self._halved(self.patterns[i], self.patterns[j]))
            A[i, j] = A[j, i] = by_z.sum(axis=0)
            Q[p] = V.T @ (self.heat.free.T @ (self.model.current.halves.T @ by_z))  # type: ignore[union-attr]
        for i in range(m):
            S[i, 1 : 1 + inputs] = self._supplied(i)
        nothing = np.zeros((n, 1))
        system = {
            "A": A, "S": S, "Q": Q, "F": np.hstack([nothing, V.T @ self.entering, -V.T @ (self.K @ V)]),
            "I": np.hstack([nothing, V.T @ self.lifted]),
        }  # fmt: skip
        outputs = {p.name: ([self._row(p)], "mean", OF_PROBES[p.quantity]) for p in self.scene.probes}
        ports = [self._port(k, channel) for k, channel in enumerate(self.channels)]
        vertices = np.zeros(self.model.elements.size)
        vertices[self.model.elements.dofs[:2]] = 1.0
        unit = (self.heat.free.T @ vertices) / self.heat.copies
        space = StateSpace.of_rows(system, outputs, ports, 1 / float(np.sqrt(unit @ (self.C @ unit))))
        warm = [1 + k for k, c in enumerate(self.channels) if UNITS[c.kind] == "K"]
        return space.in_kelvin(warm, self.scene.initial_temperature)

    def _along_z(self, cold: np.ndarray, warm: np.ndarray) -> np.ndarray:
        """(h, z): a cold number of each half, and its change per kelvin, as affine maps of z."""
        by_z = warm[:, None] * (self.model.current.halves @ self.rise)  # type: ignore[union-attr]
        by_z[:, 0] += cold
        return np.asarray(by_z)

    def _supplied(self, i: int) -> np.ndarray:
        """(inputs,): the current of a pattern at each electrode (A)."""
        circuit = self.model.current
        assert circuit is not None
        currents = self.patterns[i][: len(circuit.extra)]
        return np.asarray((circuit.fixed.T @ (circuit.across.T @ currents) - circuit.given.T @ currents)[self.columns])

    def _drawn(self, currents: np.ndarray) -> Row:
        """The sum of some currents of the patterns (patterns,)."""
        return Row(u=np.outer(currents, np.eye(self.rise.shape[1])[0]))

    def _row(self, probe: Probe) -> Row:
        if probe.quantity == "temperature":
            unknowns, inputs = self.thermal.mean(probe)
            return Row((unknowns @ self.rise + inputs @ self.given)[0])
        if probe.quantity == "heat_flow":
            return Row(self.thermal.flow(probe) @ self._heat_flows())
        if self.electric is None:
            return Row()
        if probe.quantity == "current":
            return self._drawn(self.patterns @ self.electric.flow(probe)[: self.patterns.shape[1]])
        model, circuit, (unknowns, inputs) = self.model, self.electric.circuit, self.electric.mean(probe)
        # By the resistance to a current that is drawn where the potential is read.
        resistance = model.resistances(np.zeros(model.elements.size))[1]
        row = unknowns.toarray().ravel()
        inner = factor(circuit.free.T @ circuit.matrix(1 / resistance) @ circuit.free).solve(circuit.free.T @ row)
        drawn = (circuit.free_across @ inner) / resistance
        lifted = drawn @ (circuit.given - circuit.across @ circuit.fixed) + row @ circuit.fixed + inputs
        by_pattern = [self._along_z(*self._halved(drawn, pattern)).sum(axis=0) for pattern in self.patterns]
        return Row(np.asarray(lifted).ravel() @ self.given, u=np.array(by_pattern))

    def _heat_flows(self) -> np.ndarray:
        """(flows, z): all flows of heat as affine maps of z."""
        return self.thermal.flows(self.rise, self.rise, self.given)

    def _port(self, k: int, channel: Channel) -> tuple[Row, str, float]:
        """The flow that enters at an input, or the mean temperature that its heat meets; its unit; W per unit."""
        if channel.kind == "voltage":
            return self._drawn(np.array([self._supplied(i)[k] for i in range(len(self.patterns))])), "A", 1.0
        if channel.kind in ("heat_flux", "heat_source"):
            load = self.heat.load[:, [self.columns[k]]].toarray().ravel()
            power = float(load[: self.model.elements.first_node[-1]].sum())
            return Row(load / power @ self.rise), "K", power
        return Row(self.thermal.entering(self.columns[k]) @ self._heat_flows()), "W", 1.0
