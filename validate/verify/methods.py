"""Diagonally implicit Runge-Kutta methods, L-stable and stiffly accurate, by order: rows of their tableaux.

Orders 2 and 3: Alexander, SIAM J. Numer. Anal. 14, 1977, 1006. Order 4: Hairer and Wanner, Solving Ordinary
Differential Equations II, 2nd ed., table IV.6.5.
"""

from __future__ import annotations

import numpy as np

_HALF = 1 - 0.5**0.5
# The middle root of x^3 - 3 x^2 + 3 x / 2 - 1 / 6, for which the method of order 3 is L-stable.
_GAMMA = float(np.sort(np.roots([1.0, -3.0, 1.5, -1 / 6]).real)[1])
_B = -1.5 * _GAMMA**2 + 4 * _GAMMA - 0.25
METHODS: dict[int, tuple[tuple[float, ...], ...]] = {
    2: ((_HALF,), (1 - _HALF, _HALF)),
    3: ((_GAMMA,), ((1 - _GAMMA) / 2, _GAMMA), (_B, 1 - _B - _GAMMA, _GAMMA)),
    4: (
        (1 / 4,),
        (1 / 2, 1 / 4),
        (17 / 50, -1 / 25, 1 / 4),
        (371 / 1360, -137 / 2720, 15 / 544, 1 / 4),
        (25 / 24, -49 / 48, 125 / 16, -85 / 12, 1 / 4),
    ),
}
