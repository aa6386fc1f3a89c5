"""Tables of integrals for coefficients that vary within a brick: those that are kept stay within their memory."""

import numpy as np
import pytest

from fem3d.spaces import varying


def test_tables_are_kept_within_their_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(varying, "_tables", {})
    alone = varying.reference(4, (4, 4, 4), 3)
    monkeypatch.setattr(varying, "KEPT", 2.5 * (alone.conduction.nbytes + alone.transport.nbytes))
    assert varying.reference(4, (4, 4, 4), 3) is alone
    others = [varying.reference(4, degrees, 3) for degrees in ((4, 4, 3), (4, 3, 4))]
    # That used longest ago has gone, and is made again alike.
    again = varying.reference(4, (4, 4, 4), 3)
    assert again is not alone
    assert np.array_equal(again.conduction, alone.conduction)
    assert varying.reference(4, (4, 3, 4), 3) is others[1]
    assert sum(t.conduction.nbytes + t.transport.nbytes for t in varying._tables.values()) <= varying.KEPT
    monkeypatch.setattr(varying, "KEPT", 0.0)
    assert varying.reference(4, (4, 4, 3), 3).conduction.shape == others[0].conduction.shape
    assert len(varying._tables) == 1
