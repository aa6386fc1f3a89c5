"""The Joule heat of pairs of current fields, tested with temperature fields: what the reduced problem is made of."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np

Split = tuple[np.ndarray, np.ndarray]
"""Cold (channels, m, m) and warm (m, m, r): a sum over boxes or nodes of the Joule heat of pairs of current fields."""


@dataclass(frozen=True, eq=False)
class Tested:
    """For m current fields and r temperature fields: ``cold`` (channels, m, m) and ``warm`` (m, m, r), the heat of each
    pair at the initial temperature and what each field adds to it; ``cold_load`` (channels, m, m, r) and ``warm_load``
    (m, m, r, r), the same tested with each field.

    ``in_box``: cold and warm of each conducting box alone; ``at_held``: those that fall to the nodes of a boundary of
    given temperature. ``potentials`` of probes: their shares (channels,) of the voltages, and what each current field
    takes off, cold (channels, m) and warm (m, r).
    """

    cold: np.ndarray
    warm: np.ndarray
    cold_load: np.ndarray
    warm_load: np.ndarray
    in_box: dict[str, Split] = field(default_factory=dict)
    at_held: dict[str, Split] = field(default_factory=dict)
    potentials: dict[str, tuple[np.ndarray, np.ndarray, np.ndarray]] = field(default_factory=dict)

    @staticmethod
    def nothing(channels: int, m: int, r: int, held: Iterable[str] = ()) -> Tested:
        """Zeros, to add to."""
        zeros = np.zeros
        return Tested(
            zeros((channels, m, m)), zeros((m, m, r)), zeros((channels, m, m, r)), zeros((m, m, r, r)),
            at_held={name: (zeros((channels, m, m)), zeros((m, m, r))) for name in held},
        )  # fmt: skip
