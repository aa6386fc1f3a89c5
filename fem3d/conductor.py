"""The electric problem: div(sigma(T) grad phi) = 0 in the conductors that carry current.

Conductors are followed from electrode to electrode. A part that touches electrodes of one voltage only carries no
current and gets no unknowns; neither do insulators. Voltages come as channels (`fem3d.inputs`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from scipy.sparse import coo_array, csc_array

from fem3d import resistivity, section, tensor
from fem3d.conduction import Field, Pattern, Potential
from fem3d.errors import ConvergenceError, NumericsError
from fem3d.factorization import factorize
from fem3d.joule import Tested
from fem3d.operators import HeatProblem, condition_nodes, shared
from fem3d.section import Section
from fem3d.tested import tested
from fem3d.weights import mean_row
from meshes import connected
from meshes.bricks import VOID, Block, bricks_of
from scenes.model import Material


@dataclass(frozen=True, eq=False)
class Conductor:
    """The current-carrying blocks, the numbering of their nodes (free first), and the voltages (channels, fixed nodes)
    of the fixed ones. ``electrodes``: for each its part (nodes,) of the currents that enter. ``sections`` are the
    current probes: for each the integral of the current density over it. A field has one array per block: (qx, qy, qz),
    or (3, qx, qy, qz) for a vector. It is a `fem3d.conduction.Conduction`.
    """

    heat: HeatProblem
    blocks: tuple[Block, ...]
    number: np.ndarray
    free: int
    voltages: np.ndarray
    electrodes: dict[str, np.ndarray]
    sections: dict[str, Section]

    @property
    def size(self) -> int:
        """Free and fixed nodes together."""
        return self.free + self.voltages.shape[1]

    def material(self, block: Block) -> Material:
        """The material of a block."""
        return self.heat.mesh.boxes[block.box].material

    def law(self, block: Block) -> tuple[float, float]:
        """The resistivity of a block: `fem3d.resistivity.law`."""
        return resistivity.law(self.material(block), self.heat.scene.initial_temperature)

    @property
    def warms(self) -> bool:
        """Whether any resistivity depends on the temperature."""
        return any(self.law(block)[1] for block in self.blocks)

    @cached_property
    def parts(self) -> list[tensor.Parts]:
        """The 1D factors of each block."""
        return [self.heat.mesh.parts(b) for b in self.blocks]

    @cached_property
    def local(self) -> list[np.ndarray]:
        """For each block the numbers of its nodes, (nx, ny, nz)."""
        return [self.number[self.heat.mesh.numbers(b)] for b in self.blocks]

    def resistivity(self, rise: np.ndarray) -> Field:
        """The resistivity at the Gauss points for a rise; NumericsError where it isn't positive."""
        found = []
        for block, parts in zip(self.blocks, self.parts, strict=True):
            at_room, per_kelvin = self.law(block)
            value = at_room + per_kelvin * tensor.values(parts, self.heat.on_block(block, rise))
            if not value.min() > 0:
                raise NumericsError("the resistivity falls to zero: its linear law does not reach this temperature")
            found.append(value)
        return found

    def conducts(self, rise: np.ndarray) -> bool:
        """Whether the resistivity is positive everywhere at a rise."""
        try:
            self.resistivity(rise)
        except NumericsError:
            return False
        return True

    @cached_property
    def _precondition(self) -> Any:
        rows, columns, entries = [], [], []
        for block, parts, local in zip(self.blocks, self.parts, self.local, strict=True):
            r, c = tensor.pattern(parts, local)
            keep = (r < self.free) & (c < self.free)
            rows.append(r[keep])
            columns.append(c[keep])
            entries.append((tensor.stiffness(parts) / self.law(block)[0])[keep])
        joined = (np.concatenate(entries), (np.concatenate(rows), np.concatenate(columns)))
        return factorize(csc_array(coo_array(joined, shape=(self.free, self.free)))).solve

    def gradient(self, potential: np.ndarray) -> Field:
        """grad phi at the Gauss points."""
        return [tensor.gradient(p, potential[n]) for p, n in zip(self.parts, self.local, strict=True)]

    def flow(self, density: Field) -> np.ndarray:
        """(nodes,): integral of density . grad v for every basis function."""
        found = np.zeros(self.size)
        for parts, local, j in zip(self.parts, self.local, density, strict=True):
            found[local.ravel()] += tensor.gradient_load(parts, j).ravel()
        return found

    def influence(self, row: np.ndarray) -> tuple[np.ndarray, Field]:
        """What a row (all nodes) reads off the potential of any current density J, without solving for it.

        With w the solution for the row as a source, in the cold conductor between earthed electrodes, and D its current
        density sigma grad w (reciprocity): row @ phi = shares @ g - integral rho J . D. Returns shares (channels,), D.
        """
        w = np.concatenate([self._precondition(row[: self.free]), np.zeros(self.size - self.free)])
        cold = [self.law(b)[0] for b in self.blocks]
        density = [g / r for g, r in zip(self.gradient(w), cold, strict=True)]
        shares: np.ndarray = self.voltages @ (row - self.flow(density))[self.free :]
        return shares, density

    @cached_property
    def influences(self) -> dict[str, tuple[np.ndarray, Field]]:
        """`influence` of each probe of a mean potential that lies in the conductor."""
        heat, found = self.heat, {}
        for probe in heat.scene.probes:
            if probe.quantity == "potential" and probe.reduce == "mean":
                row = mean_row(heat, probe, np.where(self.number < 0, self.size, self.number), self.size + 1)
                if not row[-1]:
                    found[probe.name] = self.influence(row[:-1])
        return found

    def solve(
        self, rise: np.ndarray, voltage: np.ndarray, guess: np.ndarray | None = None, accuracy: float = 1e-11
    ) -> Potential:
        """The potential at a given rise and voltages of the fixed nodes, by conjugate gradients preconditioned with the
        cold conductor.

        The accuracy is that of the field in the energy norm.
        """
        resistivity = self.resistivity(rise)

        def apply(u: np.ndarray) -> np.ndarray:
            return self.flow([g / r for g, r in zip(self.gradient(u), resistivity, strict=True)])

        n = self.free
        phi = np.concatenate([np.zeros(n) if guess is None else guess[:n], voltage])
        residual = apply(phi)
        power = float(phi @ residual)
        if guess is None:
            phi[:n] -= self._precondition(residual[:n])
            residual = apply(phi)
            power = float(phi @ residual)
        r = -residual[:n]
        z = self._precondition(r)
        p, rz = z, float(r @ z)
        steps = 0
        while rz > accuracy**2 * power:
            steps += 1
            if steps > 200:
                raise ConvergenceError("the electric potential does not converge")
            ap = apply(np.concatenate([p, np.zeros(self.size - n)]))[:n]
            step = rz / float(p @ ap)
            phi[:n] += step * p
            r -= step * ap
            z = self._precondition(r)
            rz, old = float(r @ z), rz
            p = z + (rz / old) * p
        density = [-g / q for g, q in zip(self.gradient(phi), resistivity, strict=True)]
        return Potential(phi, density, -self.flow(density), steps)

    def pattern(self, potential: Potential) -> Pattern:
        """The current field of a potential."""
        supply = self.voltages @ potential.reaction[self.free :]
        currents = {name: float(part @ potential.reaction) for name, part in self.electrodes.items()}
        for name, through in self.sections.items():
            currents[f"through:{name}"] = through.flux(potential.density)
        return Pattern(potential.density, supply, currents)

    def product(self, a: Field, b: Field) -> float:
        """The integral of rho Ja . Jb at the initial temperature (W)."""
        return sum(
            self.law(block)[0] * float((tensor.weights(parts) * (p * q).sum(axis=0)).sum())
            for block, parts, p, q in zip(self.blocks, self.parts, a, b, strict=True)
        )

    def heating(self, a: Field, b: Field, rise: np.ndarray) -> Field:
        """rho Ja . Jb at the Gauss points (W/m3)."""
        return [r * (p * q).sum(axis=0) for r, p, q in zip(self.resistivity(rise), a, b, strict=True)]

    def joule_load(self, a: Field, b: Field, rise: np.ndarray) -> np.ndarray:
        """(all nodes,): integral of rho Ja . Jb v, in W."""
        found = np.zeros(self.heat.size)
        for block, parts, q in zip(self.blocks, self.parts, self.heating(a, b, rise), strict=True):
            self.heat.scatter(block, tensor.load(parts, q), found)
        return found

    def joule(self, density: Field, rise: np.ndarray) -> dict[str, float]:
        """The Joule heat of each conducting box (W)."""
        found: dict[str, float] = {}
        for block, parts, q in zip(self.blocks, self.parts, self.heating(density, density, rise), strict=True):
            name = self.heat.mesh.boxes[block.box].name
            found[name] = found.get(name, 0.0) + float((tensor.weights(parts) * q).sum())
        return found

    def tested(self, basis: np.ndarray, patterns: Sequence[Pattern]) -> Tested:
        """The Joule heat of pairs of current fields, tested with temperature fields (free nodes, r)."""
        return tested(self, basis, patterns)


def find_conductor(heat: HeatProblem) -> Conductor | None:
    """The current-carrying part of a scene; ``None`` where no part touches two voltages."""
    mesh, scene = heat.mesh, heat.scene
    coarse = connected.live(scene)
    if not coarse.any():
        return None
    conducting = connected.conducting(scene)
    blocks = tuple(bricks_of(np.where(connected.refined(scene, mesh, coarse), mesh.owner, VOID)))
    mine = mesh.nodes_of(blocks)
    voltage = np.zeros((heat.inputs.count, mine.size))
    electrodes = [b for b in scene.boundaries if b.kind == "voltage"]
    for b in electrodes:
        nodes = condition_nodes(mesh, b.lower, b.upper, conducting)
        voltage[:, nodes[mine[nodes]]] = heat.inputs.split(b.value)[:, None]
    entering, _ = shared(mesh, electrodes, conducting)
    given = mine & (sum(entering.values(), np.zeros(mine.size)) > 0)
    order = heat.order
    free, fixed = order[(mine & ~given)[order]], order[(mine & given)[order]]
    number = np.full(mine.size, -1)
    number[free] = np.arange(len(free))
    number[fixed] = len(free) + np.arange(len(fixed))
    unknowns = np.concatenate([free, fixed])
    named = {name: part[unknowns] for name, part in entering.items()}
    found = {p.name: section.of(mesh, p, blocks) for p in scene.probes if p.quantity == "current"}
    return Conductor(heat, blocks, number, len(free), voltage[:, fixed], named, found)
