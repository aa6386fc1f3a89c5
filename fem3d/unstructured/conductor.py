"""The electric problem on the cells that conduct: div(grad phi / resistivity(T)) = 0 between the electrodes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from fem3d.conduction import Field, Pattern, Potential
from fem3d.errors import ConvergenceError
from fem3d.factorization import factorize
from fem3d.joule import Tested
from fem3d.resistivity import law
from fem3d.unstructured.heat import Heat, shared
from fem3d.unstructured.space import FaceSpace
from fem3d.unstructured.tested import tested

MOST_STEPS = 200


@dataclass(frozen=True, eq=False)
class Conductor:
    """The cells that conduct and their nodes, free ones first; ``cold`` (cells, 1) and ``warm`` are the resistivity at
    the initial temperature (ohm m) and its change per kelvin; ``voltages`` (channels, all nodes) the given ones.

    ``electrodes``: for each its part (all nodes,) of the currents that enter. ``sections``: the faces of each probe of
    a current inside, seen from either side. A field is one array (cells, points, 3), alone in its list. It is a
    `fem3d.conduction.Conduction`.
    """

    heat: Heat
    cells: np.ndarray
    free: np.ndarray
    cold: np.ndarray
    warm: np.ndarray
    voltages: np.ndarray
    electrodes: dict[str, np.ndarray]
    sections: dict[str, list[tuple[FaceSpace, float, np.ndarray, np.ndarray]]]

    def resistivity(self, rise: np.ndarray) -> np.ndarray:
        """(cells, points) in ohm m at a rise (all nodes)."""
        found: np.ndarray = self.cold + self.warm * self.heat.space.value(rise, self.cells)
        return found

    @property
    def warms(self) -> bool:
        """Whether any resistivity depends on the temperature."""
        return bool(self.warm.any())

    @property
    def span(self) -> float:
        """The largest difference of voltages at the start (V)."""
        given = [self.voltages[0][part > 0] for part in self.electrodes.values()]
        return float(np.ptp(np.concatenate(given)))

    def conducts(self, rise: np.ndarray) -> bool:
        """Whether the resistivity is positive everywhere."""
        return bool((self.resistivity(rise) > 0).all())

    @cached_property
    def _precondition(self) -> Any:
        matrix = self.heat.space.stiffness(1 / self.cold, self.cells)
        return factorize(matrix[self.free][:, self.free]).solve

    def solve(self, rise: np.ndarray, voltage: np.ndarray, guess: np.ndarray | None = None) -> Potential:
        """The potential at a rise and given voltages (all nodes), by conjugate gradients preconditioned with the cold
        conductor, to 1e-11 in the energy norm."""
        space, free = self.heat.space, self.free
        resistivity = self.resistivity(rise)
        matrix = space.stiffness(1 / resistivity, self.cells)
        phi = voltage.copy()
        if guess is not None:
            phi[free] = guess[free]
        inner = matrix[free][:, free]
        r = -(matrix @ phi)[free]
        z = self._precondition(r)
        if guess is None:
            phi[free] += z
            r = -(matrix @ phi)[free]
            z = self._precondition(r)
        p, rz, power = z, float(r @ z), float(phi @ (matrix @ phi))
        steps = 0
        while rz > 1e-22 * power:
            steps += 1
            if steps > MOST_STEPS:
                raise ConvergenceError("the electric potential does not converge")
            ap = inner @ p
            along = rz / float(p @ ap)
            phi[free] += along * p
            r = r - along * ap
            z = self._precondition(r)
            rz, old = float(r @ z), rz
            p = z + (rz / old) * p
        density = -space.gradient(phi, self.cells) / resistivity[..., None]
        through = {name: self._through(sides, phi, rise) for name, sides in self.sections.items()}
        return Potential(phi, [density], matrix @ phi, steps, through)

    def pattern(self, potential: Potential) -> Pattern:
        """The current field of a potential."""
        currents = {name: float(part @ potential.reaction) for name, part in self.electrodes.items()}
        currents |= {f"through:{name}": current for name, current in potential.through.items()}
        return Pattern(potential.density, self.voltages @ potential.reaction, currents)

    def product(self, a: Field, b: Field) -> float:
        """The integral of rho Ja . Jb at the initial temperature (W)."""
        weights = self.heat.space.weights[self.cells] * self.cold
        return float(np.einsum("cp,cpd,cpd->", weights, a[0], b[0]))

    def joule_load(self, a: Field, b: Field, rise: np.ndarray) -> np.ndarray:
        """(all nodes,): integral of rho Ja . Jb v, in W."""
        return self.heat.space.load(self.resistivity(rise) * (a[0] * b[0]).sum(axis=-1), self.cells)

    def joule(self, density: Field, rise: np.ndarray) -> dict[str, float]:
        """The Joule heat of each conducting body by its material (W)."""
        heating = self.resistivity(rise) * (density[0] ** 2).sum(axis=-1)
        per_cell = (self.heat.space.weights[self.cells] * heating).sum(axis=1)
        found: dict[str, float] = {}
        for number, material in enumerate(self.heat.placed.materials):
            own = float(per_cell[self.heat.placed.body[self.cells] == number].sum())
            found[material.name] = found.get(material.name, 0.0) + own
        return found

    def tested(self, basis: np.ndarray, patterns: Sequence[Pattern]) -> Tested:
        """The Joule heat of pairs of current fields, tested with temperature fields (free nodes, r)."""
        return tested(self, basis, patterns)

    @staticmethod
    def _through(
        sides: list[tuple[FaceSpace, float, np.ndarray, np.ndarray]], phi: np.ndarray, rise: np.ndarray
    ) -> float:
        """The current along the normals (A), the mean of what both sides say."""
        return sum(
            sign * float(face.flux(1 / (cold + warm * face.value(rise))) @ phi) for face, sign, cold, warm in sides
        )


def find(heat: Heat) -> Conductor | None:
    """The conductors of a scene; ``None`` where no electrode is asked for."""
    placed, space = heat.placed, heat.space
    scene, mesh = placed.scene, placed.mesh
    electrodes = [b for b in scene.boundaries if b.kind == "voltage"]
    cells = np.flatnonzero(placed.conducting)
    if not electrodes or not len(cells):
        return None
    cold, warm = np.zeros(len(placed.materials)), np.zeros(len(placed.materials))
    for i, m in enumerate(placed.materials):
        if m.resistivity is not None:
            cold[i], warm[i] = law(m, scene.initial_temperature)
    fixed = np.zeros(space.size, bool)
    voltages = np.zeros((heat.inputs.count, space.size))
    for b in electrodes:
        nodes = FaceSpace(space, placed.faces(b)).nodes()
        fixed[nodes] = True
        voltages[:, nodes] = heat.inputs.split(b.value)[:, None]
    mine = space.nodes_of(cells)
    sections = {}
    for probe in scene.probes:
        if probe.quantity == "current" and probe.group is not None and not placed.covered(probe):
            sides = []
            for faces, sign in two_sided(placed, mesh.surfaces[probe.group], placed.conducting):
                own = placed.body[faces[:, 0]][:, None]
                sides.append((FaceSpace(space, faces), sign, cold[own], warm[own]))
            sections[probe.name] = sides
    body = placed.body[cells][:, None]
    entering, _ = shared(placed, space, electrodes)
    return Conductor(heat, cells, mine[~fixed[mine]], cold[body], warm[body], voltages, entering, sections)


def two_sided(placed: Any, faces: np.ndarray, inside: np.ndarray) -> list[tuple[np.ndarray, float]]:
    """Faces inside the solid as seen from either side, each with half its normal's sign; those that have a chosen cell
    on one side only carry nothing."""
    mesh = placed.mesh
    faces = faces[~mesh.exposed(faces)]
    number = mesh.number(faces)
    cell, local = np.nonzero(np.isin(mesh.facets, number))
    every = np.stack([cell, local], axis=1)
    there = mesh.number(every)
    order = np.lexsort((cell, there))
    pairs = every[order].reshape(-1, 2, 2)
    index = np.searchsorted(mesh.number(pairs[:, 0]), number)
    pairs = pairs[index]
    other = np.where((pairs[:, :1] == faces[:, None]).all(axis=2), pairs[:, 1], pairs[:, 0])
    both = inside[faces[:, 0]] & inside[other[:, 0]]
    return [(faces[both], 0.5), (other[both], -0.5)]
