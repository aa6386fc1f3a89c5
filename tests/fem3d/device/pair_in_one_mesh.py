"""Two devices side by side on one substrate by other means: triquadratic bricks of all of it in one mesh.

Nothing of the model under test is used but the scene's numbers. The two stand symmetrically, so that a quarter is
enough: half of one element along y, and what the two have in common and what they differ by, of which one has no flux
and the other no rise at the plane between them. Heat of a film is local as in `full_order`.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import csc_matrix
from scipy.sparse.linalg import splu
from skfem import Basis, ElementHex2, MeshHex

from tests.fem3d.device.full_order import GAMMA, capacity, conduction, joined, towards, volume


def breakpoints(device):
    """Of x from the plane between the elements, of y and z (m) as the scene has them."""
    sink = device.sink
    w, p, o, middle = sink.width / 2, sink.pad_width / 2, sink.oxide_width / 2, sink.pitch / 2
    half = [towards(0, o, [3, 2, 1]), towards(o, w, [1, 2, 1]), towards(w, p, [1, 2])]
    left = [middle - piece[::-1] for piece in half[::-1]]
    edge, end = sink.substrate_width / 2, sink.length / 2 - sink.substrate_length / 2
    outer = [] if middle - p < 1e-9 else [towards(0, middle - p, [1])]
    x = [*outer, *left, *(middle + piece for piece in half), towards(middle + p, edge, [1, 3, 9])]
    near, far = sink.anchor_distance, sink.anchor_distance + sink.oxide_length
    y = [
        towards(end, -sink.pad_length, [9, 3, 1]), towards(-sink.pad_length, -far, [2, 1]),
        towards(-far, -near, [1, 2, 2, 1]), towards(-near, 0, [1, 2, 2, 1]),
        towards(0, sink.length / 2, [1, 2, 5, 15, 40, 80]),
    ]  # fmt: skip
    heights = np.cumsum([0, sink.thickness, device.insulator_thickness, device.sensor_thickness,
                         device.polymer_thickness])  # fmt: skip
    low = -sink.oxide_thickness
    z = [
        towards(low - sink.substrate_thickness, low, [240, 90, 35, 15, 8]), np.array([low, 0.0]), heights[:2],
        towards(heights[1], heights[2], [1, 2, 2, 1]), heights[2:4],
        towards(heights[3], heights[4], [1, 3, 9, 12, 9, 3, 1]),
    ]  # fmt: skip
    return [joined(axis, 1) for axis in (x, y, z)]


class Pair:
    """Both elements, each as the half of it that is meshed; each interval of the breakpoints along x, y and z is cut in
    as many as ``cuts`` has."""

    def __init__(self, device, cuts=(1, 1, 1)):
        self.device, sink = device, device.sink
        x, y, z = (joined([axis], cut) for axis, cut in zip(breakpoints(device), cuts, strict=True))
        mesh = MeshHex.init_tensor(x, y, z)
        boxes = {b.name: b for b in device.scene().boxes}

        def inside(mesh, name):
            box, at = boxes[name], mesh.p[:, mesh.t].mean(axis=1)
            aside = np.array([0.0 if name == "substrate" else sink.pitch / 2, 0.0, 0.0])
            low, high = np.array(box.lower) + aside, np.array(box.upper) + aside
            return np.all((at > low[:, None]) & (at < high[:, None]), axis=0)

        mesh = mesh.restrict(np.flatnonzero(np.any([inside(mesh, name) for name in boxes], axis=0)))
        k, c = np.zeros(mesh.nelements), np.zeros(mesh.nelements)
        for name, box in boxes.items():
            k[inside(mesh, name)], c[inside(mesh, name)] = box.material.thermal_conductivity, box.material.heat_capacity
        self.basis = basis = Basis(mesh, ElementHex2(), intorder=4)
        k, c = (np.repeat(values[:, None], basis.X.shape[-1], axis=1) for values in (k, c))
        self.K = csc_matrix(conduction.assemble(basis, k=k))
        self.M = csc_matrix(capacity.assemble(basis, c=c))
        self.films = []
        for name, material in (("beam", sink.silicon), ("gold", device.gold)):
            part = Basis(mesh, ElementHex2(), elements=np.flatnonzero(inside(mesh, name)), intorder=4)
            one = volume.assemble(part, on=1.0)
            self.films.append((part, one, one / one.sum(), material.temperature_coefficient))
        self.above = basis.get_dofs(lambda p: np.abs(p[2] - z[-1]) < 1e-12).flatten()
        below = basis.get_dofs(lambda p: np.abs(p[2] - z[0]) < 1e-12).flatten()
        between = basis.get_dofs(lambda p: np.abs(p[0]) < 1e-12).flatten()
        given = np.r_[below, self.above]
        self.free = [np.setdiff1d(np.arange(basis.N), given), np.setdiff1d(np.arange(basis.N), np.r_[given, between])]
        self.solves = [splu(self.K[f][:, f], permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True}).solve
                       for f in self.free]  # fmt: skip

    def fields(self, loads, outer):
        """(2, functions): the rises about either element, by loads (2, functions) and rises (2,) outside."""
        parts = []
        for sign, free, solve in zip((1, -1), self.free, self.solves, strict=True):
            part = np.zeros(self.basis.N)
            part[self.above] = (outer[0] + sign * outer[1]) / 2
            load = (loads[0] + sign * loads[1]) / 2 - self.K @ part
            part[free] = solve(load[free])
            parts.append(part)
        return np.array([parts[0] + parts[1], parts[0] - parts[1]])

    def local(self, field, film):
        """(functions,): the load of a film's watt about a field, of the half that is meshed."""
        part, one, mean, a = self.films[film]
        local = (1 + a * part.interpolate(field)) / (1 + a * (mean @ field))
        return volume.assemble(part, on=local) / one.sum() / 2

    def powers(self, held, outer):
        """(2, 2): powers (W) of (sink, sensor) of both elements that hold the films (element, film) in ``held`` at the
        set temperature, others having none."""
        target, field = self.device.set_rise, np.zeros((2, self.basis.N))
        power = np.zeros((2, 2))
        for _ in range(5):
            given = self.fields(np.zeros((2, self.basis.N)), outer)
            each = []
            for element, film in held:
                loads = np.zeros((2, self.basis.N))
                loads[element] = self.local(field[element], film)
                each.append(self.fields(loads, (0.0, 0.0)))
            means = [[self.films[film][2] @ by[element] for by in each] for element, film in held]
            missing = [target - self.films[film][2] @ given[element] for element, film in held]
            of = np.linalg.solve(np.array(means), np.array(missing))
            field = given + np.tensordot(of, np.array(each), axes=1)
            for (element, film), p in zip(held, of, strict=True):
                power[element, film] = p
        return power

    def after_a_step(self, held, samples):
        """(samples, 2, 2): what a step of 1 K outside of the second element adds to the powers of (sink, sensor) of
        both, at each sample from then on, with the loops of the films ``held`` at work, linear about the settled state.
        TR-BDF2 with one step from sample to sample, a film's own power as of the stage before; how its heat is spread
        in it stays as it is."""
        device, h = self.device, self.device.control.sample_time
        materials, heights = (device.sink.silicon, device.gold), (device.sink.thickness, device.sensor_thickness)
        before, gain = self.powers(held, (0.0, 0.0)), (device.control.sink_gain, device.control.sensor_gain)
        slopes = {}
        for element, film in held:
            a, power = self.films[film][3], before[element, film]
            ratio = 1 + a * device.set_rise
            cold = materials[film].resistivity * device.sink.length / (device.sink.width * heights[film])
            slopes[element, film] = np.array([2 * np.sqrt(power / (cold * ratio)), -power * a / ratio])
        lift = self.fields(np.zeros((2, self.basis.N)), (0.0, 1.0))
        at_rest = np.array([[film[2] @ field for film in self.films] for field in lift])
        parts, decaying = [], []
        for sign, free in zip((1, -1), self.free, strict=True):
            K, M = self.K[free][:, free], self.M[free][:, free]
            options = {"permc_spec": "MMD_AT_PLUS_A", "options": {"SymmetricMode": True}}
            solve = splu(csc_matrix(M + GAMMA / 2 * h * K), **options).solve
            means = [film[2][free] for film in self.films]
            loads = [film[1][free] / film[1].sum() / 4 for film in self.films]
            parts.append((sign, K, M, solve, means, loads))
            decaying.append(-(lift[0] + sign * lift[1])[free] / 2)
        voltage, found = dict.fromkeys(held, 0.0), []

        def seen(fields):
            both = [[mean @ field for mean in part[4]] for part, field in zip(parts, fields, strict=True)]
            return at_rest + np.array([np.add(*both), np.subtract(*both)])

        def added(fields):
            power, rise = np.zeros((2, 2)), seen(fields)
            for e, f in held:
                power[e, f] = slopes[e, f] @ [voltage[e, f], rise[e, f]]
            return power

        one, two = 1 / (GAMMA * (2 - GAMMA)), (1 - GAMMA) ** 2 / (GAMMA * (2 - GAMMA))
        for _ in range(samples):
            for e, f in held:
                voltage[e, f] -= gain[f] * seen(decaying)[e, f] / device.set_rise
            found.append(added(decaying))
            middles = []
            for (sign, K, M, solve, _, loads), field in zip(parts, decaying, strict=True):
                heat = (found[-1][0] + sign * found[-1][1]) @ loads
                middles.append(solve(M @ field + GAMMA * h / 2 * (2 * heat - K @ field)))
            power = added(middles)
            for i, (sign, _, M, solve, _, loads) in enumerate(parts):
                heat = (power[0] + sign * power[1]) @ loads
                old = M @ (one * middles[i] - two * decaying[i])
                decaying[i] = solve(old + (1 - GAMMA) / (2 - GAMMA) * h * heat)
        return np.array(found)
