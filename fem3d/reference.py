"""The second, independent path: the same problem assembled by scikit-fem and solved in the plainest way.

On a brick mesh of degree 1 or 2 everywhere the tensor path of this package spans the space of scikit-fem's ElementHex1
or ElementHex2, and one Gauss point more than the degree along each axis makes its quadrature of order 3 or 5.
So both must agree to the tolerance of their solvers. Here are no numbering, ordering, acceleration, reduced fields or
exact exponentials: the forms of `fem3d.forms`, Picard's iteration on the resistance, scipy's splu as it comes, and
Alexander's stiffly accurate SDIRK of order 3 (SIAM J. Numer. Anal. 14, 1977, 1006). The code verification path: slow.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from scipy.sparse import csc_matrix
from scipy.sparse.linalg import splu
from skfem import Basis, ElementHex1, ElementHex2, FacetBasis, LinearForm, MeshHex, condense
from skfem import solve as solve_linear
from skfem.helpers import dot

from fem3d import forms, sink_quantities
from fem3d.errors import NumericsError
from fem3d.sink_quantities import Quantities
from meshes.bricks import VOID, BrickMesh
from meshes.symmetry import Symmetry
from scenes.model import Boundary, Point, Scene
from scenes.sink import Sink

CONVERGED, MOST_STEPS = 3e-12, 400
# The middle root of x^3 - 3 x^2 + 3 x / 2 - 1 / 6, for which the method is L-stable.
_GAMMA = float(np.sort(np.roots([1.0, -3.0, 1.5, -1 / 6]).real)[1])
_B = -1.5 * _GAMMA**2 + 4 * _GAMMA - 0.25
STAGES = ((_GAMMA,), ((1 - _GAMMA) / 2, _GAMMA), (_B, 1 - _B - _GAMMA, _GAMMA))


def hexahedra(mesh: BrickMesh) -> tuple[MeshHex, np.ndarray]:
    """The cells of the solid as scikit-fem's mesh, and the box (cells,) that owns each."""
    cells = np.argwhere(mesh.owner != VOID)
    corners = cells[:, None, :] + MeshHex().p.T.astype(int)  # one cell: scikit-fem's order of the corners
    shape = tuple(len(axis.breaks) for axis in mesh.axes)
    used, local = np.unique(np.ravel_multi_index(tuple(np.moveaxis(corners, -1, 0)), shape), return_inverse=True)
    points = [axis.breaks[i] for axis, i in zip(mesh.axes, np.unravel_index(used, shape), strict=True)]
    return MeshHex(np.array(points), local.reshape(-1, 8).T), mesh.owner[tuple(cells.T)]


@dataclass(frozen=True, eq=False)
class FullOrder:
    """The matrices (nodes, nodes) of a scene in W/K and J/K and the load (nodes,) in W without Joule heat.

    ``owner`` is the box of each element, ``fixed`` are nodes of a given temperature, ``conducting`` elements. ``law``:
    resistivity at the initial temperature, and per kelvin, (elements, 1) each, NaN in insulators. ``films``: matrix and
    load of each face with convection or a given flux.
    """

    scene: Scene
    basis: Basis
    owner: np.ndarray
    stiffness: Any
    mass: Any
    load: np.ndarray
    fixed: np.ndarray
    conducting: np.ndarray
    law: tuple[np.ndarray, np.ndarray]
    films: dict[str, tuple[Any, np.ndarray]]

    def nodes(self, boundary: Boundary) -> np.ndarray:
        """The nodes of a flat box."""
        facets = _facets(self.basis.mesh, boundary.lower, boundary.upper)
        return np.asarray(self.basis.get_dofs(facets=facets).flatten())

    @cached_property
    def conductor(self) -> tuple[Basis, np.ndarray]:
        """The basis on all conductors, and their nodes."""
        return self.basis.with_elements(self.conducting), self.basis.get_dofs(elements=self.conducting).flatten()

    @cached_property
    def electrodes(self) -> dict[str, tuple[np.ndarray, float]]:
        """The nodes of each electrode and its voltage (V)."""
        return {b.name: (self.nodes(b), b.value) for b in self.scene.boundaries if b.kind == "voltage"}

    def heated(self, rise: np.ndarray) -> tuple[np.ndarray, dict[str, float]]:
        """The Joule load (nodes,) in W at a rise (nodes,), and the currents (A), Joule heats and power (W)."""
        part, inside = self.conductor
        rho = (self.law[0] + self.law[1] * np.asarray(self.basis.interpolate(rise)))[self.conducting]
        matrix = forms.conduction.assemble(part, conductivity=1 / rho)
        phi = np.zeros(self.basis.N)
        for nodes, value in self.electrodes.values():
            phi[nodes] = value
        held = np.concatenate([nodes for nodes, _ in self.electrodes.values()])
        phi = solve_linear(*condense(csc_matrix(matrix), np.zeros(len(phi)), x=phi, I=np.setdiff1d(inside, held)))
        flow = matrix @ phi
        read = {f"current:{name}": float(flow[nodes].sum()) for name, (nodes, _) in self.electrodes.items()}
        field = part.interpolate(phi)
        heat = (dot(field.grad, field.grad) / rho * part.dx).sum(axis=1)
        for number in np.unique(self.owner[self.conducting]):
            read[f"joule:{self.scene.boxes[number].name}"] = float(heat[self.owner[self.conducting] == number].sum())
        read["power"] = float(phi @ flow)
        return forms.joule_heat.assemble(part, conductivity=1 / rho, potential=field), read

    def outputs(self, rise: np.ndarray, rate: np.ndarray) -> dict[str, float]:
        """Means of the probes (K above the start), heat flows into the solid (W), currents, Joule heats and power."""
        joule, read = self.heated(rise)
        entering = self.stiffness @ rise + self.mass @ rate - self.load - joule
        for b in self.scene.boundaries:
            if b.kind == "temperature":
                read[f"flow:{b.name}"] = float(entering[self.nodes(b)].sum())
            elif b.name in self.films:
                matrix, load = self.films[b.name]
                read[f"flow:{b.name}"] = float((load - matrix @ rise).sum())
        for p in self.scene.probes:
            if p.quantity == "temperature":
                read[f"rise:{p.name}"] = _mean(self.basis, rise, p.lower, p.upper)
        return read


def assemble(scene: Scene, mesh: BrickMesh) -> FullOrder:
    """A scene of one or more materials on a brick mesh of degree 1 or 2 everywhere (ValueError for other degrees)."""
    degrees = set(np.concatenate([axis.degrees for axis in mesh.axes]).tolist())
    if degrees not in ({1}, {2}):
        raise ValueError(f"the second path takes one degree, 1 or 2, everywhere, not {sorted(degrees)}")
    element, order = (ElementHex1(), 3) if degrees == {1} else (ElementHex2(), 5)
    cells, owner = hexahedra(mesh)
    basis = Basis(cells, element, intorder=order)

    def per_element(values: list[float]) -> np.ndarray:
        return np.array(values)[owner][:, None] * np.ones(basis.dx.shape)

    materials = [box.material for box in scene.boxes]
    stiffness = forms.conduction.assemble(basis, conductivity=per_element([m.thermal_conductivity for m in materials]))
    mass = forms.capacity.assemble(basis, heat_capacity=per_element([m.heat_capacity for m in materials]))
    load = np.asarray(_integral.assemble(basis, density=per_element([box.heat_source for box in scene.boxes])))
    room = scene.initial_temperature
    films, fixed = {}, [np.empty(0, dtype=int)]
    for b in scene.boundaries:
        if b.kind in ("convection", "heat_flux"):
            face = FacetBasis(cells, element, facets=_facets(cells, b.lower, b.upper), intorder=order)
            h, flux = (b.value, b.value * (b.ambient - room)) if b.kind == "convection" else (0.0, b.value)
            films[b.name] = forms.film.assemble(face, coefficient=h), _integral.assemble(face, density=flux)
            stiffness, load = stiffness + films[b.name][0], load + films[b.name][1]
    cold = [np.nan if m.resistivity is None else m.resistivity for m in materials]
    slope = [r * m.temperature_coefficient for r, m in zip(cold, materials, strict=True)]
    offset = [s * (room - m.reference_temperature) for s, m in zip(slope, materials, strict=True)]
    law = per_element((np.array(cold) + np.array(offset)).tolist())[:, :1], per_element(slope)[:, :1]
    conducting = np.flatnonzero(~np.isnan(law[0][:, 0]))
    full = FullOrder(scene, basis, owner, stiffness, mass, load, np.empty(0, int), conducting, law, films)
    fixed += [full.nodes(b) for b in scene.boundaries if b.kind == "temperature"]
    return replace(full, fixed=np.unique(np.concatenate(fixed)))


def steady(full: FullOrder) -> np.ndarray:
    """(nodes,): the coupled steady rise (K), by Picard's iteration; NumericsError where it doesn't converge."""
    free = np.setdiff1d(np.arange(full.basis.N), full.fixed)
    solve = splu(csc_matrix(full.stiffness[free][:, free])).solve
    rise = np.zeros(full.basis.N)
    for _ in range(MOST_STEPS):
        old = rise.copy()
        rise[free] = solve((full.load + full.heated(rise)[0])[free])
        if np.abs(rise - old).max() <= CONVERGED * np.abs(rise).max():
            return rise
    raise NumericsError("Picard's iteration doesn't converge")


def transient(full: FullOrder, times: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
    """Rise (K) and its rate (K/s), (nodes,) each, at each of some times (s, from 0), each interval being one step."""
    free = np.setdiff1d(np.arange(full.basis.N), full.fixed)
    mass, stiffness = (csc_matrix(m[free][:, free]) for m in (full.mass, full.stiffness))
    rise, rate = np.zeros(full.basis.N), np.zeros(full.basis.N)
    rate[free] = splu(mass).solve((full.load + full.heated(rise)[0])[free])
    found, length, solve = [(rise, rate)], np.nan, None
    for step in np.diff(times):
        if solve is None or abs(step - length) > 1e-12 * step:
            length, solve = step, splu(csc_matrix(mass + _GAMMA * step * stiffness)).solve
        rates: list[np.ndarray] = []
        for weights in STAGES:
            start = rise + step * sum((w * r for w, r in zip(weights, rates, strict=False)), np.zeros(full.basis.N))
            new = rate
            for _ in range(MOST_STEPS):
                old, new = new, np.zeros(full.basis.N)
                load = full.load + full.heated(start + _GAMMA * step * old)[0]
                new[free] = solve((load - full.stiffness @ start)[free])
                if step * np.abs(new - old).max() <= 1e-11 * np.abs(start + step * new).max():
                    break
            rates.append(new)
        rise, rate = start + _GAMMA * step * new, new
        found.append((rise, rate))
    return found


def quantities(
    sink: Sink, part: Symmetry, full: FullOrder, rise: np.ndarray, rate: np.ndarray | None = None
) -> Quantities:
    """The quantities of `sink_quantities.steady` of the whole sink, from the part that was solved."""
    read = full.outputs(rise, np.zeros_like(rise) if rate is None else rate)
    whole = {name: value for name, value in read.items() if name.startswith("rise:")}
    for name, flow in part.flows.items():
        for kind, factor in (("flow", flow.heat), ("current", flow.current)):
            if f"{kind}:{flow.boundary}" in read:
                whole[f"{kind}:{name}"] = factor * read[f"{kind}:{flow.boundary}"]
    whole |= {
        f"joule:{name}": n * read[f"joule:{name}"] for name, n in part.box_copies.items() if f"joule:{name}" in read
    }
    whole["power"] = part.copies * read["power"]
    return sink_quantities.steady(sink, {name: np.array(value) for name, value in whole.items()})


def _facets(mesh: MeshHex, lower: Point, upper: Point) -> np.ndarray:
    middle, small = mesh.p[:, mesh.facets].mean(axis=1).T, 1e-9 * np.ptp(mesh.p)
    return np.flatnonzero(((middle > np.array(lower) - small) & (middle < np.array(upper) + small)).all(axis=1))


@LinearForm
def _integral(v: Any, w: Any) -> Any:
    return w.density * v


def _mean(basis: Basis, u: np.ndarray, lower: Point, upper: Point) -> float:
    """The mean over a point, a flat box or a volume (not a line)."""
    if lower == upper:
        return float((basis.probes(np.array(lower)[:, None]) @ u)[0])
    part: Any
    if any(a == b for a, b in zip(lower, upper, strict=True)):
        part = FacetBasis(basis.mesh, basis.elem, facets=_facets(basis.mesh, lower, upper), intorder=5)
    else:
        middle = basis.mesh.p[:, basis.mesh.t].mean(axis=1).T
        part = basis.with_elements(np.flatnonzero(((middle > lower) & (middle < upper)).all(axis=1)))
    return float((np.asarray(part.interpolate(u)) * part.dx).sum() / part.dx.sum())
