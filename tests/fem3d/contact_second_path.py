"""Contacts solved again: one that ends inside by quadrilaterals of scikit-fem's own, and jumps at their points; a bar
of two halves that a current warms, by hand."""

from __future__ import annotations

import numpy as np
from scipy.optimize import brentq
from scipy.sparse import coo_array
from scipy.sparse.linalg import spsolve
from skfem import Basis, BilinearForm, ElementQuad2, FacetBasis, LinearForm, MeshQuad
from skfem.helpers import dot, grad


@BilinearForm
def _conduction(u, v, w):
    return dot(grad(u), grad(v))


@BilinearForm
def _mass(u, v, w):
    return u * v


@LinearForm
def _load(v, w):
    return v


def rim_by_quadrilaterals(length: float, k: float, resistance: float, flux: float):
    """The rises (K) and the heat across the contact (W per m of depth) of a square of side 2 ``length``, cold below,
    heated above, with a contact over the left half of its middle; and by how much each may be off.

    The intervals shrink towards the rim by a half each, so the error falls with their number: the change by one layer
    less bounds it.
    """
    # In units of the length and of the rise of a square that conducts that well, as searches in cells need.
    units = dict.fromkeys(("below", "above", "block"), flux * length / k) | {"across": flux * length}
    solved = (_solved(1.0, 1.0, resistance * k / length, 1.0, layers) for layers in (12, 10))
    fine, coarse = ({name: value * units[name] for name, value in of.items()} for of in solved)
    return fine, {name: abs(fine[name] - coarse[name]) + 1e-9 * abs(fine[name]) for name in fine}


def _solved(length: float, k: float, resistance: float, flux: float, layers: int) -> dict[str, float]:
    steps = length * np.concatenate([[0.0], 0.5 ** np.arange(layers, -1, -1)])
    steps = np.unique(np.concatenate([steps, (steps[1:] + steps[:-1]) / 2]))
    at = np.unique(np.concatenate([length - steps, length + steps]))
    mesh = MeshQuad.init_tensor(at, at)
    p, t = mesh.p, mesh.t.copy()
    # Vertices on the contact, except its rim, are doubled: the cells above have their own.
    there = np.flatnonzero(np.isclose(p[1], length, rtol=1e-9) & (p[0] < length * (1 - 1e-9)))
    above = p[1, t].mean(axis=0) > length
    other = np.arange(p.shape[1])
    other[there] = p.shape[1] + np.arange(len(there))
    t[:, above] = other[t[:, above]]
    mesh = MeshQuad(np.hstack([p, p[:, there]]), t)
    element = ElementQuad2()
    basis = Basis(mesh, element)
    matrix = k * _conduction.assemble(basis)
    middles = mesh.p[:, mesh.facets].mean(axis=1)
    on = np.isclose(middles[1], length, rtol=1e-9) & (middles[0] < length) & (mesh.f2t[1] < 0)
    below = np.flatnonzero(on & (mesh.p[1, mesh.t[:, mesh.f2t[0]]].mean(axis=0) < length))
    face = _mass.assemble(FacetBasis(mesh, element, facets=below))
    # Each function below has a partner at the same place above.
    lower = np.unique(face.nonzero()[0])
    places = basis.doflocs
    upper_cells = np.flatnonzero(mesh.p[1, mesh.t].mean(axis=0) > length)
    candidates = np.unique(basis.element_dofs[:, upper_cells])
    candidates = candidates[np.isclose(places[1, candidates], length, rtol=1e-9)]
    order = np.argsort(places[0, candidates])
    partner = candidates[order][np.searchsorted(places[0, candidates][order], places[0, lower] - 1e-9 * length)]
    jump = coo_array(
        (np.concatenate([np.ones(len(lower)), -np.ones(len(lower))]),
         (np.tile(np.arange(len(lower)), 2), np.concatenate([lower, partner]))),
        shape=(len(lower), basis.N),
    ).tocsr()  # fmt: skip
    small = face[lower][:, lower]
    matrix = matrix + jump.T @ small @ jump / resistance
    load = flux * _load.assemble(FacetBasis(mesh, element, facets=np.flatnonzero(np.isclose(middles[1], 2 * length))))
    free = np.setdiff1d(np.arange(basis.N), basis.get_dofs(lambda x: np.isclose(x[1], 0.0)).all())
    u = np.zeros(basis.N)
    u[free] = spsolve(matrix[free][:, free].tocsc(), load[free])
    corner = lower[places[0, lower].argmin()]
    block = np.flatnonzero((mesh.p[:, mesh.t].mean(axis=1)[0] < length) & (mesh.p[1, mesh.t].mean(axis=0) > length))
    mean = _load.assemble(Basis(mesh, element, elements=block)) @ u / length**2
    across = float(np.ones(len(lower)) @ (small @ (jump @ u))) / resistance
    return {"below": float(u[corner]), "above": float(u[partner[places[0, lower].argmin()]]), "block": float(mean),
            "across": across}  # fmt: skip


def warmed_bar(
    lengths: tuple[float, float], area: float, k: float, line: tuple[float, float], thermal: float, electric: float,
    voltage: float,
) -> tuple[float, float, float]:  # fmt: skip
    """The rises (K) at both sides of a contact between two halves with cold ends, and the current (A); the resistivity
    is ``line`` = (rho, a), rho (1 + a rise).

    With m^2 = rho a j^2/k, rise + 1/a = cos(m s)/a + B sin(m s) in each half, s from its cold end. The flow into the
    contact, and half its own heat, crosses it; j follows from the voltage.
    """
    rho, a = line

    def at(j: float) -> tuple[float, np.ndarray]:
        m = j * np.sqrt(rho * a / k)
        c, s = np.cos(m * np.array(lengths)), np.sin(m * np.array(lengths))
        # Unknown are both B: the heat that the halves take up is the contact's own, and half its difference crosses.
        matrix = np.array([k * m * c, np.array([-1, 1]) * (k * m * c / 2 + s / thermal)])
        right = [j**2 * electric + k * m * s.sum() / a, (np.array([-1, 1]) @ (k * m * s / 2 - c / thermal)) / a]
        b = np.linalg.solve(matrix, right)
        inside = j * rho * a * (s / a + b * (1 - c)).sum() / m
        return inside + j * electric - voltage, (c - 1) / a + b * s

    j = brentq(lambda j: at(j)[0], 1e-6 * voltage / electric, voltage / (rho * sum(lengths) + electric), rtol=1e-12)
    return (*at(j)[1].tolist(), j * area)
