"""The current through pads and beam: the stream function of the silicon layer.

With the sheet current density (A/m) written as j = (dpsi/dy, -dpsi/dx) it is free of sources whatever psi is. Of all
those, the one of least heat at a given total current is the one that flows (Thomson's principle):

    div(rho_e / t grad psi) = 0,   psi = 0 on the mirror x = 0,   psi = I/2 on the insulated sides,

and the natural condition, no current along the boundary, holds on the electrodes and on the mirror y = L/2. The
resistivity enters linearly, and a psi that is off by e gives a resistance that is too large by e^2.
"""

from __future__ import annotations

import numpy as np

from reduced1d.equations import room_resistivity
from reduced1d.ladder.plate import COPIES, Current, Heat, Plate, factorize


def current_through_pads(plate: Plate, rise: np.ndarray | None = None) -> Current:
    """The current between the pads' outer faces in a plate with a given rise (n,), ``None`` for the cold one.

    What it does is told for the cold resistivity, as ``Heat`` is; its pattern is the hot one's.
    """
    from skfem import BilinearForm, LinearForm
    from skfem.helpers import dot, grad

    sink, basis = plate.sink, plate.basis
    resistivity, a = room_resistivity(sink.silicon, sink.room_temperature)
    hot = 1.0 if rise is None else 1.0 + a * np.asarray(basis.interpolate(rise))
    matrix = BilinearForm(lambda u, v, w: w["hot"] * dot(grad(u), grad(v))).assemble(basis, hot=hot).tocsc()
    psi, free = _sides(plate)
    psi[free] = factorize(matrix[free][:, free]).solve(-(matrix @ psi)[free])

    slope = grad(basis.interpolate(psi))
    # The density of a 1 A current's heat per area of the layer.
    density = resistivity / sink.thickness * dot(slope, slope)
    source = LinearForm(lambda v, w: w["heat"] * v)
    feedback = BilinearForm(lambda u, v, w: w["heat"] * u * v)

    def heat(where: np.ndarray) -> Heat:
        elements = np.flatnonzero(where)
        part = basis.with_elements(elements)
        vector = COPIES * source.assemble(part, heat=density[elements])
        return Heat(float(vector.sum()), vector, COPIES * feedback.assemble(part, heat=density[elements]).tocsc())

    return Current(heat(plate.quarter.beam), heat(plate.quarter.pad))


def _sides(plate: Plate) -> tuple[np.ndarray, np.ndarray]:
    """psi (n,) with its values on the insulated sides and zero elsewhere, and which of it are free."""
    sink, basis, mesh = plate.sink, plate.basis, plate.basis.mesh
    small = np.diff(np.unique(mesh.p[0])).min() / 2, np.diff(np.unique(mesh.p[1])).min() / 2
    outer = mesh.boundary_facets()
    x, y = mesh.p[:, mesh.facets[:, outer]].mean(axis=1)
    mirror, open_ends = x < small[0], (y > sink.length / 2 - small[1]) | (y < small[1] - sink.pad_length)
    psi = np.zeros(basis.N)
    sides = basis.get_dofs(outer[~(mirror | open_ends)]).all()
    psi[sides] = 0.5
    given = np.union1d(sides, basis.get_dofs(outer[mirror]).all())
    return psi, np.setdiff1d(np.arange(basis.N), given)
