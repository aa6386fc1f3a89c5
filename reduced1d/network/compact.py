"""A network as a compact model: projected on a few fields, its currents on the few patterns that they have, with the
error of that against the network itself.

The fields are responses of the rise to every input, to its jumps and to the Joule heat of every pair of current
patterns, at rest and at rates spread over the time scales (rational Krylov spaces), by their weight in the stored
heat.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from reduced1d.network.circuit import factor
from reduced1d.network.lines import Layout, layout
from reduced1d.network.model import Model
from reduced1d.network.readings import Reader
from reduced1d.network.solution import EARLY, magnitudes, refined, solve
from reduced1d.network.solvers import steady
from scenes import physics
from scenes.errors import SceneError
from scenes.model import DERIVED, AnyScene, Probe, Schedule
from statespace.channels import OWN, UNITS, Channel, channels, scenarios
from statespace.device_reduction import Reference, reduce
from statespace.document import Matrices, Port, in_kelvin, scene_document


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
    made = _Projection(model)
    most = min(made.fields.shape[1], 48)
    document = reduce(made.document, most, references, accuracy, states, "the network")
    text = ["Estimated: the distance from the network of lines itself for each of these inputs, with its own error."]
    return document | {"estimated": {"runs": len(references), "text": text}}


def _reference(shape: Layout, inputs: tuple[Channel, ...], own: Mapping[str, float]) -> Reference:
    """Solve the network of a scenario; scales are at least a hundredth of the ``own`` ones of the scene itself."""
    scene = shape.scene
    values = {c.name: c.value for c in channels(scene)}
    tables: dict[str, Any] = {c.name: values.get(c.name, 0.0) for c in inputs}
    tables = {n: (v.times, v.values) if isinstance(v, Schedule) else v for n, v in tables.items()}
    start = {p.name: scene.initial_temperature for p in scene.probes if p.quantity == "temperature"}
    times = None if scene.steady else np.geomspace(10 * EARLY, 1, 40) * scene.end_time
    result = solve(shape, times, steady_too=False)
    if result.traces is None:
        exact = {n: np.array(e.value) for n, e in result.steady.items()}
        errors = {n: e.error for n, e in result.steady.items()}
    else:
        exact, errors = result.traces.values, result.traces.errors
    rises = {n: np.atleast_1d(v) - start.get(n, 0.0) for n, v in exact.items()}
    scales = {n: max(size, 0.01 * own.get(n, 0.0)) for n, size in magnitudes(shape, rises).items()}
    return Reference(tables, times, exact, errors, scales)


class _Projection:
    """A network on its leading ``fields`` (f, n): z = (1, inputs in their own units, states).

    ``patterns`` (p, flows) are the independent currents, as flows of ``electric``, the reader of the current.
    """

    def __init__(self, model: Model) -> None:
        assert model.heat is not None
        self.model, self.heat, self.scene = model, model.heat, model.layout.scene
        self.channels = channels(self.scene)
        names = [b.name for b in self.scene.boundaries]
        self.columns = [model.inputs.sources[c.item] if c.kind == "heat_source" else names.index(c.item)
                        for c in self.channels]  # fmt: skip
        free = self.heat.free
        self.K = (free.T @ model.stiffness @ free).tocsc()
        self.C = (free.T @ model.capacity @ free).tocsc()
        self.lifted = (free.T @ model.capacity @ self.heat.fixed).toarray()[:, self.columns]
        if self.scene.steady:
            self.C, self.lifted = self.K, 0 * self.lifted
        self.entering = (free.T @ (model.entering - model.stiffness @ self.heat.fixed)).toarray()[:, self.columns]
        measured = {q: tuple(p for p in self.scene.probes if p.quantity == q) for q in ("heat_flow", "current")}
        self.thermal = Reader(model, False, measured["heat_flow"])
        self.electric = Reader(model, True, measured["current"]) if model.current else None
        self.patterns = self._patterns()
        self.pairs = [(i, j) for i in range(len(self.patterns)) for j in range(i, len(self.patterns))]
        self.fields = self._fields()

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

    def _fields(self) -> np.ndarray:
        """(f, n): fields in the order of their weight."""
        free, couples, current = self.heat.free, self.model.couples, self.model.current
        halves = (current.halves @ free).tocsr() if current else None
        joule = [self._halved(self.patterns[i], self.patterns[j]) for i, j in self.pairs]
        loads = np.column_stack([self.entering, self.lifted, *(halves.T @ cold for cold, _ in joule)])  # type: ignore
        loads = loads[:, np.abs(loads).max(axis=0) > 0]
        rates = [] if self.heat.floats else [0.0]
        if not self.scene.steady:
            rates += (np.geomspace(0.3, 3 / EARLY, 12) / self.scene.end_time).tolist()
        snapshots = []
        for rate in rates:
            lu, right = factor(self.K + rate * self.C), loads
            # Heating follows the temperature: the responses to the heat of responses, and so on four times, as each
            # shrinks the remainder by the feedback's share.
            for _ in range(5 if couples else 1):
                responses = lu.solve(right)
                norms = np.sqrt(np.einsum("fk,fk->k", responses, self.C @ responses))
                responses = responses / np.where(norms > 0, norms, 1.0)
                snapshots.append(responses)
                followed = (halves.T @ (warm[:, None] * (halves @ responses)) for _, warm in joule)  # type: ignore
                right = np.hstack([responses[:, :0], *followed])
        every = np.hstack(snapshots)
        sizes, vectors = np.linalg.eigh(every.T @ (self.C @ every))
        kept = sizes > 1e-14 * sizes[-1]
        return np.asarray((every @ (vectors[:, kept] / np.sqrt(sizes[kept])))[:, ::-1])

    def document(self, count: int) -> dict[str, Any]:
        """The model of the first fields, without its errors."""
        V = self.fields[:, :count]
        rates, turn = np.linalg.eigh(V.T @ (self.K @ V))
        V, inputs, m = V @ turn, len(self.channels), len(self.patterns)
        inertia = V.T @ self.lifted
        F = np.hstack([np.zeros((count, 1)), V.T @ self.entering + rates[:, None] * inertia, -np.diag(rates)])
        fixed, whole = self.heat.fixed.toarray()[:, self.columns], self.heat.free @ V
        self.rise = np.hstack([np.zeros((len(whole), 1)), fixed - whole @ inertia, whole])
        self.given = np.zeros((len(self.model.inputs.values), self.rise.shape[1]))
        self.given[self.columns, 1 + np.arange(inputs)] = 1.0
        z = self.rise.shape[1]
        A, Q, S = np.zeros((m, m, z)), np.zeros((len(self.pairs), count, z)), np.zeros((m, z))
        for p, (i, j) in enumerate(self.pairs):
            cold, warm = self._halved(self.patterns[i], self.patterns[j])
            by_z = self._along_z(cold, warm)
            A[i, j] = A[j, i] = by_z.sum(axis=0)
            Q[p] = whole.T @ (self.model.current.halves.T @ by_z)  # type: ignore[union-attr]
        for i in range(m):
            S[i, 1 : 1 + inputs] = self._supplied(i)
        rows = [self._row(probe) for probe in self.scene.probes]
        outputs = {probe.name: ([k], "mean") for k, probe in enumerate(self.scene.probes)}
        ports = []
        for k, channel in enumerate(self.channels):
            row, unit, size = self._port(k, channel)
            ports.append(Port(len(rows), unit, size))
            rows.append(row)
        Y, U = np.array([y for y, _ in rows]), np.array([u for _, u in rows]).reshape(len(rows), m, z)
        P, W = np.zeros((len(self.pairs), len(rows), z)), np.zeros((len(rows), inputs))
        matrices = {"A": A, "S": S, "F": F, "Q": Q, "Y": Y, "W": W, "U": np.moveaxis(U, 0, 1), "P": P}
        start, scene = self.scene.initial_temperature, self.scene
        in_kelvin(matrices, [1 + k for k, c in enumerate(self.channels) if UNITS[c.kind] == "K"], start)
        warm_rows = [k for k, probe in enumerate(scene.probes) if probe.quantity == "temperature"]
        Y[[*warm_rows, *(port.row for port in ports if port.unit == "K")], 0] += start
        name = f"{scene.name}, the network of its boxes"
        return scene_document(
            scene, name, self.channels, Matrices(matrices, outputs, ports), 10 * EARLY * scene.end_time
        )

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

    def _row(self, probe: Probe) -> tuple[np.ndarray, np.ndarray]:
        """(z,) and (patterns, z): the rows of a probe, and for each pattern."""
        y, u = np.zeros(self.rise.shape[1]), np.zeros((len(self.patterns), self.rise.shape[1]))
        if probe.quantity == "temperature":
            unknowns, inputs = self.thermal.mean(probe)
            y = (unknowns @ self.rise + inputs @ self.given)[0]
        elif probe.quantity == "heat_flow":
            y = self.thermal.flow(probe) @ self._heat_flows()
        elif self.electric is None:
            pass
        elif probe.quantity == "current":
            u[:, 0] = self.patterns @ self.electric.flow(probe)[: self.patterns.shape[1]]
        else:
            model, circuit, (unknowns, inputs) = self.model, self.electric.circuit, self.electric.mean(probe)
            # By the resistance to a current that is drawn where the potential is read.
            resistance = model.resistances(np.zeros(model.elements.size))[1]
            row = unknowns.toarray().ravel()
            inner = factor(circuit.free.T @ circuit.matrix(1 / resistance) @ circuit.free).solve(circuit.free.T @ row)
            drawn = (circuit.free_across @ inner) / resistance
            for i, pattern in enumerate(self.patterns):
                u[i] = self._along_z(*self._halved(drawn, pattern)).sum(axis=0)
            lifted = drawn @ (circuit.given - circuit.across @ circuit.fixed) + row @ circuit.fixed + inputs
            y = np.asarray(lifted).ravel() @ self.given
        return y, u

    def _heat_flows(self) -> np.ndarray:
        """(flows, z): all flows of heat as affine maps of z."""
        return self.thermal.flows(self.rise, self.rise, self.given)

    def _port(self, k: int, channel: Channel) -> tuple[tuple[np.ndarray, np.ndarray], str, float]:
        """The flow that enters at an input, or the mean temperature that its heat meets, as a row; its unit; W per
        unit."""
        y, u = np.zeros(self.rise.shape[1]), np.zeros((len(self.patterns), self.rise.shape[1]))
        if channel.kind == "voltage":
            u[:, 0] = [self._supplied(i)[k] for i in range(len(self.patterns))]
            return (y, u), "A", 1.0
        if channel.kind in ("heat_flux", "heat_source"):
            load = self.heat.load[:, [self.columns[k]]].toarray().ravel()
            power = float(load[: self.model.elements.first_node[-1]].sum())
            return (load / power @ self.rise, u), "K", power
        return (self.thermal.entering(self.columns[k]) @ self._heat_flows(), u), "W", 1.0
