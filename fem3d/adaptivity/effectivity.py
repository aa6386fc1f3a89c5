"""How much larger estimated errors are than true ones, as meshes tell of one another.

On tetrahedra an estimate adds absolute parts, and believes that what is left falls as slowly as next to the sharpest
edge: it is safe, and often ten times the error. The next mesh tells by how much. Let errors be the same fraction i of
their estimates E on both (the inverse of the effectivity index of Ainsworth and Oden, A Posteriori Error Estimation in
Finite Element Analysis, Wiley 2000): then a reading moves from one to the other by i times the difference of the
estimates.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from fem3d.adaptivity.goal_errors import Level

# An error is stated as 1 + n^(-1/2) times the largest fraction i that any of n readings tells on any earlier mesh, as
# one alone may be right by chance, but not below this fraction of its estimate. `validate stress` compares random
# plates with pads with finer solutions. Of 37 such scenes, combs and stacks with vias, no error on a later mesh is
# above 0.67 of what is then stated, and half of them are above 0.15 (0.09 of the estimates); of a meander with 50 pads
# beside it one is 0.81, against NGSolve at order 3.
LEAST = 0.25
# Errors of readings that have what later degrees change of them (`fem3d.adaptivity.later`) are stated as this fraction
# of their estimates at most, and, where these fell on the last mesh, as so many times `Level.least`. Of 46 random
# plates, meshes from Gmsh, meanders and stacks with vias, compared with meshes of 100,000 to 150,000 unknowns, no error
# is above 0.70 of what is then stated on a first mesh, or above 0.65 on a later one, and half of them are above 0.06.
AS_IT_IS, CAUTION = 0.5, 1.25
KNOWN = 1e-8  # relative: smaller errors, and readings that move less, tell of rounding alone
# A reading that moves by more than its estimate falls is wrong by more than estimated: so is one that sees an edge at
# which a poor conductor is held at a temperature and a good one isn't (exponents of 0.1, where the slowest rate that is
# assumed belongs to 1/4). What is stated is then twice the fraction of that reading, without a limit, told by meshes
# since which the estimate fell to this part or less: by less it may fall by chance.
FELL = 0.8


Known = Mapping[str, tuple[float, float]]
"""The estimated error of each reading, and by how much rounding may move it."""


@dataclass
class Told:
    """The readings on the meshes of a search, and what is known of each, mesh by mesh."""

    meshes: list[tuple[Mapping[str, float], Known, Mapping[str, float]]] = field(default_factory=list)

    def corrected(self, level: Level) -> Level:
        """A level with errors, and with what its goals miss, as much smaller or larger as earlier meshes say; none is
        stated smaller than the level says, nor than its estimate where this is no smaller than on the mesh before,
        which was then refined for other readings. The first level is as it is. Of extrapolated readings half of the
        estimate takes the place of all of it."""
        values = {name: float(value) for name, value in level.fine.quantities.items()}
        known = {n: (e, KNOWN * level.scales[n]) for n, e in level.errors.items() if e > KNOWN * level.scales[n]}
        part, larger = self._parts(values, known)
        fell = {n for before in self.meshes[-1:] for n, (e, _) in before[1].items() if level.errors[n] <= FELL * e}
        most = self._cautious(values, level)
        self.meshes.append((values, known, level.least))
        whole = AS_IT_IS if level.extrapolated else 1.0
        smaller = {n: min(part * e, most.get(n, np.inf)) if n in fell else np.inf for n, e in level.errors.items()}
        errors = {
            n: max(min(e, max(min(smaller[n], whole * e), level.least[n])), larger.get(n, 0.0) * e)
            for n, e in level.errors.items()
        }
        # What is stated of a reading's estimate is what is missing.
        parts = {n: max(part, larger.get(n, 0.0)) for n in level.goals}
        parts |= {n: min(parts[n], errors[n] / e) for n, e in level.errors.items() if n in parts and e > 0}
        goals = {n: [parts[n] * missing for missing in spread] for n, spread in level.goals.items()}
        return replace(level, errors=errors, goals=goals)

    def _cautious(self, values: Mapping[str, float], level: Level) -> dict[str, float]:
        """The most that the errors of extrapolated readings are, from what is doubtful of them: `CAUTION` times that,
        or as many times more as any reading has moved from the mesh before by more than what is doubtful on both."""
        if not level.extrapolated or not self.meshes:
            return {}
        before, _, doubts = self.meshes[-1]
        moved = [abs(v - before[n]) / max(doubts[n] + level.least[n], 1e-300) for n, v in values.items()]
        return {n: CAUTION * max([1.0, *moved]) * doubt for n, doubt in level.least.items()}

    def _parts(self, values: Mapping[str, float], known: Known) -> tuple[float, dict[str, float]]:
        """The part of each estimate that is stated, at most all of it, and for those readings that tell of errors above
        their estimates how many times these."""
        fractions, larger = dict[str, float](), dict[str, float]()
        for before, estimates, _ in self.meshes:
            for n in estimates.keys() & known.keys():
                moved = abs(values[n] - before[n])
                (estimate, rounding), (after, _) = estimates[n], known[n]
                if moved > rounding:
                    fraction = moved / max(estimate - after, 1e-300)
                    fractions[n] = max(fractions.get(n, 0.0), fraction)
                    if fraction > 1 and after <= FELL * estimate:
                        larger[n] = max(larger.get(n, 0.0), 2 * fraction)
        if not fractions:
            return 1.0, larger
        return min(max((1 + len(fractions) ** -0.5) * max(fractions.values()), LEAST), 1.0), larger
