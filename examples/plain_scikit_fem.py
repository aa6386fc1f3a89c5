"""The 3D model in one screen: the sink's steady state at 1 V by scikit-fem, on one mesh.

A quarter of the sink: x from its middle across, y from its middle along the beam, z up from the oxide's top.
"""

import numpy as np
from skfem import Basis, BilinearForm, ElementHex2, Functional, LinearForm, MeshHex, condense, solve
from skfem.helpers import dot, grad

conduction = BilinearForm(lambda u, v, w: w.conductivity * dot(grad(u), grad(v)))
joule_heat = LinearForm(lambda v, w: w.conductivity * dot(grad(w.potential), grad(w.potential)) * v)

# Table 1 of the paper, in SI units; every length in m.
SILICON, OXIDE = 130.0, 1.38  # thermal conductivity, W/(m K)
RESISTIVITY, COEFFICIENT, REFERENCE = 6e-5, 5e-4, 293.0  # ohm m, 1/K, K
ROOM, VOLTAGE, UM = 293.0, 1.0, 1e-6

# Cells end at the edges of every body, and are shorter where heat turns from beam to pad and down into the oxide.
x = [0, 8, 16, 21, 25, 29, 36, 43, 50, 55, 63, 75]
y = [0, 100, 200, 300, 400, 450, 475, 490, 500, 506, 515, 530, 543, 550, 556, 565, 575, 585, 594, 600, 607, 625, 650]
z = [-2, -1, -0.4, 0, 0.4, 1, 2]
grid = MeshHex.init_tensor(*(np.array(breaks) * UM for breaks in (x, y, z)))
cx, cy, cz = grid.p[:, grid.t].mean(axis=1) / UM  # middles of the cells, um
beam = (cy < 500) & (cx < 50) & (cz > 0)
pad = (cy > 500) & (cz > 0)
oxide = (cy > 550) & (cy < 600) & (cx < 25) & (cz < 0)
mesh = grid.remove_elements(np.flatnonzero(~(beam | pad | oxide)))
cx, cy, cz = mesh.p[:, mesh.t].mean(axis=1) / UM

# Quadratic functions on every cell for the temperature, on the beam's for the potential. Gauss points of order 5
# integrate products of quadratic functions exactly.
everywhere = Basis(mesh, ElementHex2(), intorder=5)
along = Basis(mesh, ElementHex2(), elements=np.flatnonzero(cy < 500), intorder=5)

conductivity = np.where(cz > 0, SILICON, OXIDE)[:, None]
K = conduction.assemble(everywhere, conductivity=np.broadcast_to(conductivity, everywhere.dx.shape))
bottom = everywhere.get_dofs(lambda at: np.isclose(at[2], -2 * UM))  # oxide on the substrate, at room temperature
middle = along.get_dofs(lambda at: np.isclose(at[1], 0.0))  # half-way between the electrodes: no potential
end = along.get_dofs(lambda at: np.isclose(at[1], 500 * UM))  # an electrode: the beam's end cross section

potential = along.zeros()
potential[end] = VOLTAGE / 2
rise = everywhere.zeros()
for _ in range(50):
    # Current: div(sigma(T) grad phi) = 0 in the beam.
    warm = along.interpolate(rise)
    sigma = 1 / (RESISTIVITY * (1 + COEFFICIENT * (ROOM + warm - REFERENCE)))
    A = conduction.assemble(along, conductivity=sigma)
    carries = np.setdiff1d(along.get_dofs(elements=along.tind).all(), np.union1d(middle.all(), end.all()))
    potential = solve(*condense(A, x=potential, I=carries))
    # Heat: div(k grad T) + sigma |grad phi|^2 = 0 everywhere.
    f = joule_heat.assemble(along, conductivity=sigma, potential=along.interpolate(potential))
    before, rise = rise, solve(*condense(K, f, D=bottom))
    if np.abs(rise - before).max() < 1e-9 * rise.max():
        break

mean = Functional(lambda w: w["u"]).assemble(along, u=along.interpolate(rise)) / along.dx.sum()
peak = rise[everywhere.get_dofs(lambda at: np.isclose(at[1], 0.0))].max()
power = 4 * f.sum()
print(f"{rise.size} unknowns: peak rise {peak:.3f} K, mean rise {mean:.3f} K, current {power / VOLTAGE * 1e3:.4f} mA")
