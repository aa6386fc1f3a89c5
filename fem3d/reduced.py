"""The coupled problem projected on a few temperature fields and a few current fields.

Temperature: rise = sum_k a_k T_k. Current density: J = sum_i c_i J_i, each J_i the exact (discrete) current field of
some temperature. With the resistivity linear in T everything is polynomial in (a, c):

    current:  sum_j A_ij(a) c_j = s_i,      A_ij(a) = integral rho(a) J_i . J_j,   s_i the power that the electrodes
                                            would supply to J_i at their voltages
    heat:     M da/dt + K a = f + sum_ij c_i c_j integral rho(a) J_i . J_j T_l

The first line is the principle of least dissipation (Thomson's) among the J_i; it is exact at every temperature whose
current field is among them, and second-order accurate between them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fem3d import tensor
from fem3d.conductor import Conductor, Field, law
from fem3d.operators import HeatProblem

DEPENDENT = 1e-6  # fields are dropped whose part independent of earlier ones is smaller than this


@dataclass(frozen=True, eq=False)
class Reduced:
    """Reduced matrices; ``basis`` (free nodes, r) is orthonormal in the mass matrix, so M is the identity.

    For pairs (i, j) of current fields: ``cold[i, j]`` and ``warm[i, j, k]`` make up A; ``cold_load[i, j, l]`` and
    ``warm_load[i, j, l, k]`` the Joule heat. ``in_box`` holds the same four for the heat of each conducting box alone.
    """

    basis: np.ndarray
    stiffness: np.ndarray
    source: np.ndarray
    supply: np.ndarray
    cold: np.ndarray
    warm: np.ndarray
    cold_load: np.ndarray
    warm_load: np.ndarray
    in_box: dict[str, tuple[np.ndarray, np.ndarray]]

    @property
    def states(self) -> int:
        """How many temperature fields."""
        return self.basis.shape[1]

    def dissipation(self, a: np.ndarray) -> np.ndarray:
        """(..., m, m): the matrix A of the resistances at states a."""
        m = len(self.supply)
        return self.cold + (a @ self.warm.reshape(m * m, -1).T).reshape(*a.shape[:-1], m, m)

    def currents(self, a: np.ndarray) -> np.ndarray:
        """(..., m): the coefficients c of the current fields at states a (..., r)."""
        matrix = self.dissipation(a)
        if len(self.supply) == 1:
            return self.supply / matrix[..., 0]
        return np.linalg.solve(matrix, np.broadcast_to(self.supply, matrix.shape[:-1])[..., None])[..., 0]

    def joule(self, a: np.ndarray, c: np.ndarray) -> np.ndarray:
        """(..., r): the Joule heat tested with each temperature field."""
        m2, r = len(self.supply) ** 2, self.states
        pairs = (c[..., :, None] * c[..., None, :]).reshape(*c.shape[:-1], m2)
        warm = (a @ self.warm_load.reshape(m2 * r, r).T).reshape(*a.shape[:-1], m2, r)
        return pairs @ self.cold_load.reshape(m2, r) + (pairs[..., None, :] @ warm)[..., 0, :]

    def linear_joule(self, c: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """At given currents the Joule heat is affine in a: constant (r,) and matrix (r, r)."""
        m2, r = len(c) ** 2, self.states
        pairs = np.outer(c, c).ravel()
        return pairs @ self.cold_load.reshape(m2, r), (pairs @ self.warm_load.reshape(m2, r * r)).reshape(r, r)


def project(
    heat: HeatProblem, conductor: Conductor | None, basis: np.ndarray, densities: list[Field], supply: list[float]
) -> Reduced:
    """Project on temperature fields (free nodes, r; any basis) and current fields at the scene's voltages."""
    basis = orthonormal(heat, basis)
    r, m, n = basis.shape[1], len(densities), heat.free
    stiffness = basis.T @ (heat.inner_stiffness @ basis)
    cold, warm = np.zeros((m, m)), np.zeros((m, m, r))
    cold_load, warm_load = np.zeros((m, m, r)), np.zeros((m, m, r, r))
    in_box: dict[str, tuple[np.ndarray, np.ndarray]] = {}
    if conductor is not None:
        for number, (block, parts) in enumerate(zip(conductor.blocks, conductor.parts, strict=True)):
            at_room, per_kelvin = law(conductor.material(block), heat.scene)
            fields = np.stack([tensor.values(parts, heat.on_block(block, u)).ravel() for u in basis.T], axis=1)
            weight = tensor.weights(parts).ravel()
            cold_here, warm_here = np.zeros((m, m)), np.zeros((m, m, r))
            for i in range(m):
                for j in range(i + 1):
                    heating = weight * (densities[i][number] * densities[j][number]).sum(axis=0).ravel()
                    first = heating @ fields
                    cold_here[i, j] = cold_here[j, i] = at_room * heating.sum()
                    warm_here[i, j] = warm_here[j, i] = per_kelvin * first
                    cold_load[i, j] += at_room * first
                    warm_load[i, j] += per_kelvin * (fields.T * heating) @ fields if per_kelvin else 0.0
                    if i != j:
                        cold_load[j, i], warm_load[j, i] = cold_load[i, j], warm_load[i, j]
            cold += cold_here
            warm += warm_here
            name = heat.mesh.boxes[block.box].name
            old = in_box.get(name, (np.zeros((m, m)), np.zeros((m, m, r))))
            in_box[name] = (old[0] + cold_here, old[1] + warm_here)
    source = basis.T @ heat.constant_source[:n]
    return Reduced(basis, stiffness, source, np.array(supply), cold, warm, cold_load, warm_load, in_box)


def orthonormal(heat: HeatProblem, fields: np.ndarray) -> np.ndarray:
    """The fields (free nodes, r) made orthonormal in the mass matrix, those dropped that depend on earlier ones.

    Gram-Schmidt, twice for each field (Giraud et al., Numer. Math. 101, 2005), and a last pass by Cholesky.
    """
    kept, weighted = (np.empty(fields.shape, order="F") for _ in range(2))
    r = 0
    for u, v in zip(fields.T, (heat.inner_mass @ fields).T, strict=True):
        size = float(u @ v)
        u = u - kept[:, :r] @ (weighted[:, :r].T @ u)
        u = u - kept[:, :r] @ (weighted[:, :r].T @ u)
        v = heat.inner_mass @ u
        left = float(u @ v)
        if left > DEPENDENT**2 * size:
            kept[:, r], weighted[:, r] = u / np.sqrt(left), v / np.sqrt(left)
            r += 1
    basis = kept[:, :r]
    again = np.linalg.cholesky(basis.T @ weighted[:, :r])
    found: np.ndarray = np.linalg.solve(again, basis.T).T
    return found
