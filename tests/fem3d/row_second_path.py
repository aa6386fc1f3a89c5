"""A row of spans solved another way: quadratic hexahedra on a mesh of their own, one current for the whole row.

Nothing of `fem3d` is used. The current between the ends of the beam is uniform, so that I = V / R with R the mean of
the resistivity along the row over its cross section; the rise follows from fixed-point steps, in time by a second-order
L-stable Runge-Kutta method (Alexander, SIAM J. Numer. Anal. 14, 1977).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np
from scipy.sparse.linalg import splu
from skfem import Basis, BilinearForm, ElementHex2, LinearForm, MeshHex
from skfem.helpers import dot, grad

from scenes.sink import Sink

Rises = dict[str, float]


@dataclass(frozen=True)
class SecondRow:
    """A row at the beam-end voltage, with cells at edges as short as ``first`` (m), growing by ``ratio``."""

    sink: Sink
    first: float = 4e-6
    ratio: float = 3.0

    @cached_property
    def _planes(self) -> tuple[list[float], list[float], list[float]]:
        s = self.sink
        middle = (s.spans * s.length + (s.spans - 1) * s.island) / 2
        u, far = s.anchor_distance, s.anchor_distance + s.oxide_length
        x = {0.0, s.width / 2, s.pad_width / 2, s.oxide_width / 2, s.island_width / 2}
        y = {-s.pad_length, -far, -u, 0.0, middle}
        for k in range(1, s.spans + 1):
            a = (k - 1) * (s.length + s.island)
            y |= {c for c in (a, a + s.length / 2, a + s.length) if c < middle * (1 - 1e-9)}
        return sorted(x), sorted(y), [-s.oxide_thickness, 0.0, s.thickness]

    @cached_property
    def basis(self) -> Basis:
        """Of a quarter: x > 0, up to the row's middle."""
        x, y, z = (self._graded(p) if d < 2 else np.array(p) for d, p in enumerate(self._planes))
        mesh = MeshHex.init_tensor(x, y, z)
        return Basis(
            mesh.restrict(np.flatnonzero(self._where(mesh)[0] | self._where(mesh)[1])), ElementHex2(), intorder=5
        )

    def _graded(self, planes: list[float]) -> np.ndarray:
        found = [planes[0]]
        for a, b in pairwise(planes):
            steps = [self.first]
            while sum(steps) < (b - a) / 2:
                steps.append(steps[-1] * self.ratio)
            half = np.cumsum(steps) / sum(steps) * (b - a) / 2
            found += [*(a + half), *(b - half[-2::-1]), b]
        return np.array(found)

    def _where(self, mesh: Any) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Which cells are silicon and oxide, and of these which are the beam's; and the number of each one's span."""
        s = self.sink
        x, y, z = mesh.p[:, mesh.t].mean(axis=1)
        beam = (y > 0) & (abs(x) < s.width / 2) & (z > 0)
        pad = (y < 0) & (z > 0)
        period = s.length + s.island
        over = (y > 0) & (y % period > s.length)
        far = s.anchor_distance + s.oxide_length
        anchor = (-far < y) & (y < -s.anchor_distance) & (abs(x) < s.oxide_width / 2) & (z < 0)
        oxide = anchor | (over & (abs(x) < s.island_width / 2) & (z < 0))
        return beam | pad, oxide, beam, np.where(beam & ~over, y // period + 1, 0).astype(int)

    @cached_property
    def _matrices(self) -> tuple[Any, ...]:
        s, b = self.sink, self.basis
        silicon, _, beam, of_span = self._where(b.mesh)
        k = np.where(silicon, s.silicon.thermal_conductivity, s.oxide.thermal_conductivity)[:, None] + 0 * b.dx
        c = np.where(silicon, s.silicon.heat_capacity, s.oxide.heat_capacity)[:, None] + 0 * b.dx
        stiffness = BilinearForm(lambda u, v, w: w.k * dot(grad(u), grad(v))).assemble(b, k=k)
        mass = BilinearForm(lambda u, v, w: w.c * u * v)
        capacity = mass.assemble(b, c=c)
        unit = LinearForm(lambda v, w: v)
        own = b.with_elements(np.flatnonzero(beam))
        line, pairs = unit.assemble(own), mass.assemble(own, c=np.ones(own.dx.shape))
        if s.convection_coefficient:
            top = b.mesh.facets_satisfying(lambda p: abs(p[2] - s.thickness) < 1e-12, boundaries_only=True)
            air = b.boundary(top)
            stiffness = stiffness + s.convection_coefficient * BilinearForm(lambda u, v, w: u * v).assemble(air)
        means = []
        for number in range(1, (s.spans + 1) // 2 + 1):
            v = unit.assemble(b.with_elements(np.flatnonzero(of_span == number)))
            means.append(v / v.sum())
        bottom = b.get_dofs(lambda p: abs(p[2] + s.oxide_thickness) < 1e-12).all()
        return stiffness.tocsc(), capacity.tocsc(), line, pairs.tocsc(), np.array(means), bottom

    def _heat(self, rise: np.ndarray) -> tuple[np.ndarray, float]:
        """The Joule heat of each function (W) and the current (A) at a rise."""
        s, (_, _, line, pairs, _, _) = self.sink, self._matrices
        rho, a = s.silicon.resistivity or 0.0, s.silicon.temperature_coefficient
        a0 = 1 + a * (s.room_temperature - s.silicon.reference_temperature)
        # A quarter: half the width and half the row; the resistance of the whole is in all of both.
        resistance = 4 * rho * (a0 * line.sum() + a * line @ rise) / s.cross_section**2
        current = s.spans * s.voltage / resistance
        density = current / s.cross_section
        return density**2 * rho * (a0 * line + a * (pairs @ rise)), current

    def steady(self) -> Rises:
        """The steady quantities, with the names of summary.json."""
        stiffness, _, _, _, _, bottom = self._matrices
        free = np.setdiff1d(np.arange(self.basis.N), bottom)
        solve = splu(stiffness[free][:, free].tocsc()).solve
        rise = np.zeros(self.basis.N)
        for _ in range(30):
            heat, current = self._heat(rise)
            before, rise = rise.copy(), np.zeros(self.basis.N)
            rise[free] = solve(heat[free])
            if np.abs(rise - before).max() < 1e-10 * rise.max():
                break
        return self._read(rise, current)

    def at(self, time: float, steps: int = 12, blocks: int = 5) -> Rises:
        """The quantities at a time (s): ``steps`` steps each of lengths that double from block to block."""
        stiffness, capacity, _, _, _, bottom = self._matrices
        free = np.setdiff1d(np.arange(self.basis.N), bottom)
        k, m = stiffness[free][:, free].tocsc(), capacity[free][:, free].tocsc()
        gamma, rise = 1 - np.sqrt(0.5), np.zeros(self.basis.N)
        lengths = time * 4.0 ** np.arange(blocks) / (4.0 ** np.arange(blocks)).sum() / steps
        for h in lengths:
            solve = splu((m + gamma * h * k).tocsc()).solve
            for _ in range(steps):
                start = rise.copy()
                stage = start
                for share in (gamma, 1 - gamma):
                    own = stage.copy()
                    for _ in range(2):
                        slope = solve(self._heat(own)[0][free] - k @ stage[free])
                        own = stage.copy()
                        own[free] += gamma * h * slope
                    if share == gamma:
                        first = slope
                        stage = start.copy()
                        stage[free] += (1 - gamma) * h * first
                rise = start.copy()
                rise[free] += h * ((1 - gamma) * first + gamma * slope)
        return self._read(rise, self._heat(rise)[1])

    def _read(self, rise: np.ndarray, current: float) -> Rises:
        s, means = self.sink, self._matrices[4]
        found = {"current_A": current}
        for number, row in enumerate(means, start=1):
            middle = (number - 1) * (s.length + s.island) + s.length / 2
            distance = np.abs(self.basis.doflocs - np.array([[0.0], [middle], [s.thickness / 2]])).sum(axis=0)
            found[f"span{number}_mean_rise_K"] = float(row @ rise)
            found[f"span{number}_middle_rise_K"] = float(rise[distance.argmin()])
        return found
