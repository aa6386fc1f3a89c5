"""The coupled problem projected on a few temperature fields and a few current fields.

Temperature: rise = sum_k a_k T_k + sum_c g_c L_c, the L_c being the rises that the given temperatures keep up. Current
density: J = sum_i c_i J_i, each J_i the exact (discrete) current field of some temperature. With the resistivity linear
in T everything is polynomial in (a, c) and linear in the inputs g:

    current:  sum_j A_ij(a, g) c_j = s_i(g),    A_ij = integral rho J_i . J_j,   s_i the power that the electrodes would
                                                supply to J_i at their voltages
    heat:     M da/dt + K a = f(g) - M_L dg/dt + sum_ij c_i c_j integral rho J_i . J_j T_l

The first line is the principle of least dissipation (Thomson's) among the J_i; it is exact at every temperature whose
current field is among them, and second-order accurate between them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.sparse import csc_array

from fem3d.problems.current import Conductor
from fem3d.problems.heat import HeatProblem
from fem3d.problems.paths import CurrentField, Label

DEPENDENT = 1e-6  # smallest independent part of a field, relative; rounding, 1e-16, is then 1e-10 of the part


@dataclass(frozen=True, eq=False)
class Reduced:
    """The matrices of r temperature fields and m current fields. The inputs' channels come first.

    Attributes
    ----------
    basis : (free dofs, r), orthonormal in the mass matrix, so that M is the identity
    stiffness : (r, r)
    source, inertia : (channels, r), the heat sources, and M of the lifts, tested with each field
    supply : (channels, m), the power that the electrodes would supply to each current field
    constraints, prescribed : (k, m) and (channels, k): where currents are given, constraints @ c = g @ prescribed
    resistance : (m, m, channels + r), the matrix A, linear in inputs and states, with resistances before electrodes
    heating : (m, m, r, channels + r), integral rho J_i . J_j T_l of the solids, linear likewise
    by_label, at_given : (m, m, channels + r), the parts of A by label of rows, and at the dofs of given temperatures
    potentials : of probes the shares (channels,) of the voltages, and the drop by each current field (m, channels + r)
    """

    basis: np.ndarray
    stiffness: np.ndarray
    source: np.ndarray
    inertia: np.ndarray
    supply: np.ndarray
    constraints: np.ndarray
    prescribed: np.ndarray
    resistance: np.ndarray
    heating: np.ndarray
    by_label: dict[Label, np.ndarray]
    at_given: dict[str, np.ndarray]
    potentials: dict[str, tuple[np.ndarray, np.ndarray]]

    @property
    def states(self) -> int:
        """How many temperature fields."""
        return self.basis.shape[1]

    def changed(self, to: np.ndarray) -> Reduced:
        """The same problem, or a part, in other temperature fields, orthonormal sums of these: ``to`` (r, new)."""
        inputs = len(self.source)

        def turned(parts: np.ndarray) -> np.ndarray:
            return np.concatenate([parts[..., :inputs], parts[..., inputs:] @ to], axis=-1)

        return replace(
            self, basis=self.basis @ to, stiffness=to.T @ self.stiffness @ to, source=self.source @ to,
            inertia=self.inertia @ to, resistance=turned(self.resistance),
            heating=np.swapaxes(np.swapaxes(turned(self.heating), -1, -2) @ to, -1, -2),
            by_label={name: turned(part) for name, part in self.by_label.items()},
            at_given={name: turned(part) for name, part in self.at_given.items()},
            potentials={name: (shares, turned(drop)) for name, (shares, drop) in self.potentials.items()},
        )  # fmt: skip

    def currents(self, a: np.ndarray, g: np.ndarray) -> np.ndarray:
        """(..., m): the coefficients c of the current fields at states a (..., r) and inputs g (..., channels); NaN
        where the resistances are not positive, as no current answers a voltage there.

        Where currents are given, A c - B^T u = s and B c is given: the least dissipation under the constraints B has
        the multipliers u, the unknown potentials of electrodes.
        """
        k, m = self.constraints.shape
        matrix = _at(self.resistance, a, g)
        try:
            np.linalg.cholesky(matrix)
        except np.linalg.LinAlgError:
            return np.full(matrix.shape[:-1], np.nan)
        whole = np.zeros((*matrix.shape[:-2], m + k, m + k))
        whole[..., :m, :m], whole[..., :m, m:], whole[..., m:, :m] = matrix, self.constraints.T, self.constraints
        right = np.concatenate([g @ self.supply, g @ self.prescribed], axis=-1)
        return np.asarray(np.linalg.solve(whole, right[..., None])[..., :m, 0])

    def joule(self, a: np.ndarray, c: np.ndarray, g: np.ndarray) -> np.ndarray:
        """(..., r): the Joule heat tested with each temperature field."""
        m2, r = self.supply.shape[1] ** 2, self.states
        pairs = (c[..., :, None] * c[..., None, :]).reshape(*c.shape[:-1], 1, m2)
        return (pairs @ _at(self.heating.reshape(m2, r, -1), a, g))[..., 0, :]


def _at(parts: np.ndarray, a: np.ndarray, g: np.ndarray) -> np.ndarray:
    """(..., *rest): parts (*rest, channels + r) at states a (..., r) and inputs g (..., channels)."""
    z = np.concatenate([np.broadcast_to(g, (*a.shape[:-1], g.shape[-1])), a], axis=-1)
    return (z @ parts.reshape(-1, z.shape[-1]).T).reshape(*z.shape[:-1], *parts.shape[:-1])


def project(
    heat: HeatProblem, conductor: Conductor | None, basis: np.ndarray, patterns: Sequence[CurrentField],
    values: np.ndarray | None = None,
) -> Reduced:  # fmt: skip
    """The reduced problem on some temperature fields (free dofs, r), perhaps with their ``values`` (r, rows, points) in
    the conductor, and on current fields."""
    n, channels = heat.free, heat.inputs.count
    source, inertia = heat.loads[:, :n] @ basis, np.zeros((channels, basis.shape[1]))
    for c, lift in enumerate(heat.lifts):
        if lift.any():
            inertia[c] = (heat.mass @ lift)[:n] @ basis
            if not heat.domain.anchored:
                source[c] -= (heat.stiffness @ lift)[:n] @ basis
    stiffness = basis.T @ (heat.inner_stiffness @ basis)
    supply = np.array([p.supply for p in patterns]).reshape(-1, channels).T
    constraints, prescribed = _given_currents(conductor, patterns, channels)
    joule = _joule(heat, conductor, basis, patterns, values)
    return Reduced(basis, stiffness, source, inertia, supply, constraints, prescribed, **joule)


def _joule(
    heat: HeatProblem, conductor: Conductor | None, basis: np.ndarray, patterns: Sequence[CurrentField],
    values: np.ndarray | None,
) -> dict[str, Any]:  # fmt: skip
    """The Joule heat in `Reduced` by its names.

    With J_i the current densities, v_k the temperature fields, l_c the lift of channel c and rho = cold + warm times
    the rise, the heat of the pair i, j at the point x of a body is J_i . J_j (cold + warm (sum_c g_c l_c + a . v)).
    """
    m, r, channels = len(patterns), basis.shape[1], heat.inputs.count
    resistance, heating = np.zeros((m, m, channels + r)), np.zeros((m, m, r, channels + r))
    by_label, at_given = dict[Label, np.ndarray](), {name: np.zeros_like(resistance) for name in heat.shares}
    potentials = dict[str, tuple[np.ndarray, np.ndarray]]()
    parts: dict[str, Any] = {"resistance": resistance, "heating": heating, "by_label": by_label}
    parts |= {"at_given": at_given, "potentials": potentials}
    if conductor is None or not patterns:
        return parts
    on = conductor.on
    densities = np.array([p.density for p in patterns])
    values = on.value(heat.field(basis.T)) if values is None else values
    fields = np.concatenate([on.value(heat.field(heat.lifts)), values])
    at_dofs = [on.value(heat.field(share)) for share in heat.shares.values()]
    for probe, (shares, _, _) in conductor.influences.items():
        potentials[probe] = shares, np.zeros((m, channels + r))
    for label in dict.fromkeys(conductor.labels.tolist()):
        rows = conductor.labels == label
        cold, warm = ((on.weights[rows] * each[rows]).ravel() for each in (conductor.cold, conductor.warm))
        v = fields[:, rows].reshape(channels + r, -1)
        currents = densities[:, :, rows].reshape(m, densities.shape[1], -1)
        products = np.einsum("idx,jdx->ijx", currents, currents)
        shares = np.array([np.ones(cold.shape), *(u[rows].ravel() for u in at_dofs)])
        every = _integrals((shares[:, None, None] * products).reshape(-1, len(cold)), cold, warm, v)
        by_label[label], *given = every.reshape(len(shares), m, m, -1)
        resistance += by_label[label]
        for part, added in zip(at_given.values(), given, strict=True):
            part += added
        for a, b in zip(*np.tril_indices(m), strict=True):
            heats = warm * products[a, b] * v
            heats[0] += cold * products[a, b]
            heating[a, b] += v[channels:] @ heats.T
            heating[b, a] = heating[a, b]
        for probe, (_, density, _) in conductor.influences.items():
            across = np.einsum("idx,dx->ix", currents, density[:, rows].reshape(density.shape[0], -1))
            potentials[probe][1][:] += _integrals(across, cold, warm, v)
    for t in conductor.terminals:
        if t.conductance:
            through = np.array([p.currents[t.name] for p in patterns])
            resistance[..., 0] += t.resistance * np.outer(through, through)
            for probe, (_, _, of_terminals) in conductor.influences.items():
                potentials[probe][1][:, 0] += of_terminals[t.name] * through
    return parts


def _integrals(densities: np.ndarray, cold: np.ndarray, warm: np.ndarray, fields: np.ndarray) -> np.ndarray:
    """(k, channels + r): the integrals of rho times some densities (k, points), linear in inputs and states. ``cold``
    and ``warm`` (points,) have the weights of the points; ``fields`` (channels + r, points) are lifts and fields."""
    integrals: np.ndarray = (warm * densities) @ fields.T
    integrals[:, 0] += densities @ cold
    return integrals


def _given_currents(
    conductor: Conductor | None, patterns: Sequence[CurrentField], channels: int
) -> tuple[np.ndarray, np.ndarray]:
    """`Reduced.constraints` and `Reduced.prescribed`: sums of the given currents that the fields draw independently.
    The fields have all their channels' currents, so that dependent currents are given alike."""
    if conductor is None or not conductor.draws_current or not patterns:
        return np.empty((0, len(patterns))), np.empty((channels, 0))
    fed = [i for i, t in enumerate(conductor.terminals) if not t.conductance]
    drawn = np.array([[p.currents[conductor.terminals[i].name] for p in patterns] for i in fed])
    given = conductor.voltages[:, conductor.space.size :][:, fed]
    u, sizes, v = np.linalg.svd(drawn, full_matrices=False)
    # A current far below the others, as in a wire that only senses, is their rounding error.
    kept = sizes > DEPENDENT * max(abs(current) for p in patterns for current in p.currents.values())
    return sizes[kept, None] * v[kept], given @ u[:, kept]


def independent_fields(
    fields: np.ndarray, mass: csc_array, known: np.ndarray, loads: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Make fields (free dofs, r) orthonormal in the mass matrix in their order, to each other and to ``known`` ones,
    without dependent fields: by Gram and Schmidt, twice for each (Giraud et al., Numer. Math. 101, 2005). Return the
    known and the new fields, and the products of the mass matrix and these, of which ``loads`` are the known ones."""
    # About 16 fields are made orthogonal to earlier ones in one product of matrices.
    for block in np.array_split(fields, 1 + fields.shape[1] // 16, axis=1):
        sizes, new, products = (block * (mass @ block)).sum(axis=0), known[:, :0], loads[:, :0]
        for _ in range(2):
            block = block - known @ (loads.T @ block)
        for u, size in zip(block.T, sizes, strict=True):
            for _ in range(2):
                u = u - new @ (products.T @ u)
            # Made anew: the rounding errors of earlier fields grow where little is left of one.
            v = mass @ u
            remaining = float(u @ v)
            if remaining > DEPENDENT**2 * size:
                new, products = (np.column_stack([a, b / np.sqrt(remaining)]) for a, b in ((new, u), (products, v)))
        known, loads = np.hstack([known, new]), np.hstack([loads, products])
    return known, loads


def independent_currents(
    conductor: Conductor, potentials: Sequence[CurrentField], least: float = 0.0
) -> list[CurrentField]:
    """The current fields of some potentials, orthogonal to earlier fields in the cold resistance, scaled to the first.

    Fields whose independent part is relatively smaller than ``least`` are left out. So are parts below 1e-6: scaled up,
    the residuals of their potentials would violate the conservation of charge.
    """
    patterns: list[CurrentField] = []
    product = conductor.product
    for potential in potentials:
        new = potential
        whole = product(new.density, new.density)
        for pattern in patterns:
            share = product(pattern.density, new.density) / product(pattern.density, pattern.density)
            new = new.plus(-share, pattern, 1.0)
        remaining = product(new.density, new.density)
        if remaining > max(1e-6, least) ** 2 * whole:
            size = product(patterns[0].density, patterns[0].density) if patterns else remaining
            patterns.append(new.plus(0.0, new, np.sqrt(size / remaining)))
    return patterns


def combined_density(parts: Sequence[CurrentField], c: np.ndarray) -> np.ndarray:
    """The current density with coefficients c."""
    return np.sum([f * p.density for f, p in zip(c, parts, strict=True)], axis=0)
