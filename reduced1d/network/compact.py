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

from reduced1d.network.circuit import Circuit, factor
from reduced1d.network.flows import EVERYWHERE, Flows
from reduced1d.network.lines import Layout, layout
from reduced1d.network.model import Model
from reduced1d.network.readings import Reader
from reduced1d.network.solution import EARLY, measures, of_layout, refined, spread
from reduced1d.network.steady import steady
from scenes import physics
from scenes.errors import SceneError
from scenes.model import DERIVED, AnyScene, Probe, Schedule
from statespace.channels import OWN, UNITS, Channel, channels, scenarios
from statespace.document import Matrices, Port, in_kelvin, scene_document
from statespace.reduction import Reference, reduce

MOST_STATES = 48
RATES, APART, INSTANTS = 12, 1e-7, 40
"""Number of rates (1/s) at which responses are taken; patterns and fields with a relative singular value below the
second are dropped; number of times at which the model is compared."""
FEEDBACK = 4
"""How many times heating that follows the temperature is followed by its own response; each time shrinks what is left
by the feedback's share."""


def compact(
    scene: AnyScene, states: int | None, accuracy: float, say: Callable[[str], None] = lambda _: None
) -> dict[str, Any]:
    """Make the document of a network's compact model; arguments, result and errors as of `fem3d.compact.find`."""
    physics.refuse_terminals(scene, "a network's compact model")
    untyped: Any = scene
    shape = layout(replace(untyped, probes=tuple(p for p in untyped.probes if p.quantity not in DERIVED)))
    scene = shape.scene
    if any(p.reduce != "mean" for p in scene.probes):
        raise SceneError('a network\'s compact model has no extremes: give its probes reduce = "mean", or points')
    if not physics.heat(scene):
        raise SceneError("a network is exported with its heat, and nothing thermal is asked for: add a temperature")
    end = scene.end_time
    model = refined(shape, 0)[1] if scene.steady else refined(shape, 0, 0.1 * EARLY * end)[1]
    references, inputs = dict[str, list[Reference]](), channels(scene)
    for name, other in scenarios(scene, inputs).items():
        say(f"compact model: {name}")
        of_boxes: Any = other
        sizes = references[OWN][0].scales if references else {}
        references[name] = [_reference(replace(shape, scene=of_boxes), inputs, model, sizes)]
    made = _Projection(model)
    document = reduce(made.document, min(made.most, MOST_STATES), references, accuracy, states, "the network")
    text = ["Estimated: the distance from the network of lines itself for each of these inputs, with its own error."]
    return document | {"estimated": {"runs": len(references), "text": text}}


def _reference(shape: Layout, inputs: tuple[Channel, ...], model: Model, own: Mapping[str, float]) -> Reference:
    """Solve the network of a scenario; scales are at least a hundredth of the ``own`` ones of the scene itself."""
    scene = shape.scene
    values = {c.name: c.value for c in channels(scene)}
    tables: dict[str, Any] = {c.name: values.get(c.name, 0.0) for c in inputs}
    tables = {n: (v.times, v.values) if isinstance(v, Schedule) else v for n, v in tables.items()}
    start = {p.name: scene.initial_temperature for p in scene.probes if p.quantity == "temperature"}
    if scene.steady:
        estimates = of_layout(shape).steady
        times, exact = None, {n: np.array(e.value) for n, e in estimates.items()}
        errors = {n: e.error for n, e in estimates.items()}
    else:
        times = np.geomspace(10 * EARLY, 1, INSTANTS) * scene.end_time
        traces = of_layout(shape, times, steady_too=False).over_time
        exact, errors = traces.values, traces.errors
    rises = {n: np.atleast_1d(v) - start.get(n, 0.0) for n, v in exact.items()}
    scales = {n: max(size, 0.01 * own.get(n, 0.0)) for n, size in measures(model, rises).items()}
    return Reference(tables, times, exact, errors, scales)


class _Projection:
    """A network on its leading fields: z = (1, inputs in their own units, states)."""

    def __init__(self, model: Model) -> None:
        assert model.heat is not None
        self.model, self.heat, self.scene = model, model.heat, model.layout.scene
        self.channels = channels(self.scene)
        self.columns = [self._column(c) for c in self.channels]
        free = self.heat.free
        self.K = (free.T @ model.stiffness @ free).tocsc()
        self.C = (free.T @ model.capacity @ free).tocsc()
        self.lifted = (free.T @ model.capacity @ self.heat.fixed).toarray()[:, self.columns]
        if self.scene.steady:
            self.C, self.lifted = self.K, 0 * self.lifted
        self.entering = (free.T @ (model.entering - model.stiffness @ self.heat.fixed)).toarray()[:, self.columns]
        self.patterns, self.flows = self._patterns()
        self.pairs = [(i, j) for i in range(len(self.patterns)) for j in range(i, len(self.patterns))]
        self.fields = self._fields()
        self.most = self.fields.shape[1]

    def _column(self, channel: Channel) -> int:
        if channel.kind == "heat_source":
            return self.model.inputs.sources[channel.item]
        return [b.name for b in self.scene.boundaries].index(channel.item)

    def _patterns(self) -> tuple[np.ndarray, Flows | None]:
        """(patterns, flows): the independent currents of a volt at each electrode, cold and as it is at last."""
        model = self.model
        if model.current is None:
            return np.empty((0, 0)), None
        flows = Flows(model, True, tuple(p for p in self.scene.probes if p.quantity == "current"))
        x = model.inputs.at(np.inf)
        states = [np.zeros(model.elements.size)]
        if model.couples:
            volts = x[np.array(model.inputs.electric, bool)]
            states.append(steady(model, x, spread(volts)).rise)
        volts = np.eye(len(x))[:, np.array(model.inputs.electric, bool)]
        currents = []
        for rise in states:
            rises = np.repeat(rise[:, None], volts.shape[1], axis=1)
            currents.append(flows.at(rises, model.potentials(rises, volts), volts))
        modes, sizes, _ = np.linalg.svd(np.hstack(currents), full_matrices=False)
        return (modes[:, sizes > APART * sizes[0]] * sizes[0]).T, flows

    @property
    def _circuit(self) -> Circuit:
        assert self.model.current is not None
        return self.model.current

    def _halved(self, i: int, j: int) -> tuple[np.ndarray, np.ndarray]:
        """(h,) twice: the Joule heat of two patterns in each half, cold, and per kelvin (W)."""
        circuit, law = self._circuit, self.model.law
        product = self.patterns[i][circuit.branch] * self.patterns[j][circuit.branch] * circuit.size
        return product * law[0], product * law[1]

    def _fields(self) -> np.ndarray:
        """(f, n): fields in the order of their weight."""
        joule = [self.heat.free.T @ (self._circuit.halves.T @ self._halved(i, j)[0]) for i, j in self.pairs]
        loads = np.column_stack([self.entering, self.lifted, *joule])
        loads = loads[:, np.abs(loads).max(axis=0) > 0]
        exits = not (self.heat.components() < 0).any()
        end = self.scene.end_time
        rates = [0.0] * exits if self.scene.steady else [*[0.0] * exits, *np.geomspace(0.3, 3 / EARLY, RATES) / end]
        snapshots = []
        for rate in rates:
            lu, right = factor(self.K + rate * self.C), loads
            # Heating follows the temperature: the responses to the heat of responses, and so on.
            for _ in range(1 + FEEDBACK * self.model.couples):
                responses = lu.solve(right)
                norms = np.sqrt(np.einsum("fk,fk->k", responses, self.C @ responses))
                responses = responses / np.where(norms > 0, norms, 1.0)
                snapshots.append(responses)
                right = np.hstack([self._followed(i, j, responses) for i, j in self.pairs] or [responses[:, :0]])
        every = np.hstack(snapshots)
        sizes, vectors = np.linalg.eigh(every.T @ (self.C @ every))
        kept = sizes > APART**2 * sizes[-1]
        return np.asarray((every @ (vectors[:, kept] / np.sqrt(sizes[kept])))[:, ::-1])

    def _followed(self, i: int, j: int, fields: np.ndarray) -> np.ndarray:
        """(f, any): the change of two patterns' Joule heat with a rise (f, any)."""
        halves = (self._circuit.halves @ self.heat.free).tocsr()
        return np.asarray(halves.T @ (self._halved(i, j)[1][:, None] * (halves @ fields)))

    def document(self, count: int) -> dict[str, Any]:
        """The model of the first fields, without its errors."""
        V = self.fields[:, :count]
        rates, turn = np.linalg.eigh(V.T @ (self.K @ V))
        V, inputs, m = V @ turn, len(self.channels), len(self.patterns)
        inertia = V.T @ self.lifted
        F = np.hstack([np.zeros((count, 1)), V.T @ self.entering + rates[:, None] * inertia, -np.diag(rates)])
        fixed = self.heat.fixed.toarray()[:, self.columns]
        whole = self.heat.free @ V
        self.rise = np.hstack([np.zeros((len(whole), 1)), fixed - whole @ inertia, whole])
        z = self.rise.shape[1]
        A, Q, S = np.zeros((m, m, z)), np.zeros((len(self.pairs), count, z)), np.zeros((m, z))
        for p, (i, j) in enumerate(self.pairs):
            cold, warm = self._halved(i, j)
            halves = self._circuit.halves
            by_z = warm[:, None] * (halves @ self.rise)
            by_z[:, 0] += cold
            A[i, j] = A[j, i] = by_z.sum(axis=0)
            Q[p] = (self.heat.free @ V).T @ (halves.T @ by_z)
        for i in range(m):
            S[i, 1 : 1 + inputs] = self._supplied(i)
        outputs: dict[str, tuple[list[int], str]] = {}
        rows, ports = list[tuple[np.ndarray, np.ndarray]](), list[Port]()
        for probe in self.scene.probes:
            outputs[probe.name] = [len(rows)], "mean"
            rows.append(self._row(probe))
        for k, channel in enumerate(self.channels):
            row, unit, size = self._port(k, channel)
            ports.append(Port(len(rows), unit, size))
            rows.append(row)
        Y, U = np.array([y for y, _ in rows]), np.array([u for _, u in rows]).reshape(len(rows), m, z)
        U = np.moveaxis(U, 0, 1)
        P, W = np.zeros((len(self.pairs), len(rows), z)), np.zeros((len(rows), inputs))
        matrices = {"A": A, "S": S, "F": F, "Q": Q, "Y": Y, "W": W, "U": U, "P": P}
        start, scene = self.scene.initial_temperature, self.scene
        in_kelvin(matrices, [1 + k for k, c in enumerate(self.channels) if UNITS[c.kind] == "K"], start)
        warm_rows = [outputs[p.name][0][0] for p in scene.probes if p.quantity == "temperature"]
        Y[[*warm_rows, *(port.row for port in ports if port.unit == "K")], 0] += start
        made = Matrices(matrices, outputs, ports)
        return scene_document(
            scene, f"{scene.name}, the network of its boxes", self.channels, made, 10 * EARLY * scene.end_time
        )

    def _supplied(self, i: int) -> np.ndarray:
        """(inputs,): the current of a pattern at each electrode (A)."""
        circuit = self._circuit
        currents = self.patterns[i][: len(circuit.extra)]
        return np.asarray((circuit.fixed.T @ (circuit.across.T @ currents) - circuit.given.T @ currents)[self.columns])

    def _row(self, probe: Probe) -> tuple[np.ndarray, np.ndarray]:
        """(z,) and (patterns, z): the rows of a probe, and for each pattern."""
        model, m = self.model, len(self.patterns)
        y, u = np.zeros(self.rise.shape[1]), np.zeros((m, self.rise.shape[1]))
        inputs = slice(1, 1 + len(self.channels))
        if probe.quantity == "temperature":
            reading = Reader(model, False).reading(probe)
            y += (reading.unknowns @ self.rise)[0]
            y[inputs] += reading.inputs[0, self.columns]
        elif probe.quantity == "heat_flow":
            flows = Flows(model, False, (probe,))
            row, given = flows.through(probe)
            y += self._of_flows(flows, row)
            y[inputs] += given[self.columns]
        elif probe.quantity == "current" and self.flows is not None:
            u[:, 0] = self.patterns @ self.flows.through(probe)[0]
        elif m:
            reading, circuit = Reader(model, True).reading(probe), self._circuit
            # By the resistance to a current that is drawn where the potential is read.
            resistance = model.resistances(np.zeros(model.elements.size))[1]
            row = np.asarray(reading.unknowns.todense()).ravel()
            inner = factor(circuit.free.T @ circuit.matrix(1 / resistance) @ circuit.free).solve(circuit.free.T @ row)
            drawn = (circuit.free_across @ inner) / resistance
            for i in range(m):
                product = (drawn * self.patterns[i][: len(drawn)])[circuit.branch] * circuit.size
                u[i] = (product * model.law[1]) @ (circuit.halves @ self.rise)
                u[i, 0] += float(product @ model.law[0])
            lifted = drawn @ (circuit.given - circuit.across @ circuit.fixed) + row @ circuit.fixed
            y[inputs] += np.asarray(lifted).ravel()[self.columns] + reading.inputs[0, self.columns]
        return y, u

    def _of_flows(self, flows: Flows, row: np.ndarray) -> np.ndarray:
        """(z,): a row on flows of heat as one on z."""
        rise, count = self.rise, len(self.channels)
        x = np.zeros((len(self.model.inputs.values), rise.shape[1]))
        x[self.columns, 1 + np.arange(count)] = 1.0
        return np.asarray(row @ flows.at(rise, rise, x))

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
            return (y + load / power @ self.rise, u), "K", power
        flows = Flows(self.model, False, ())
        row = np.zeros(flows.size)
        for c, condition in enumerate(self.model.layout.conditions):
            if condition.boundary == self.columns[k]:
                row += flows._condition(c, *EVERYWHERE)[0]
        return (y + self._of_flows(flows, row), u), "W", 1.0
