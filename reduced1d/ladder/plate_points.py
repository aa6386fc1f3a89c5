"""The quadrature points of a plate whose properties follow the temperature, and its bare faces."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from reduced1d.ladder.following import Following, Points
from reduced1d.ladder.layer import Layer
from scenes.sink import Sink

if TYPE_CHECKING:
    import skfem
    from scipy.sparse import csr_matrix

COPIES = 4.0  # The plate is a quarter of the sink.


def following_of(layer: Layer, of_beam: np.ndarray, of_oxide: np.ndarray, basis: skfem.Basis, heat: float) -> Following:
    """The laws of a layer at the basis' quadrature points, with the ``heat`` of 1 A per area of the beam (W/m2); which
    elements are of the beam, and above oxide."""
    sink = layer.sink
    from scipy.sparse import csr_matrix

    points = basis.dx.size
    rows = np.arange(points).reshape(basis.dx.shape)

    def at_points(evaluate: Callable[[Any], np.ndarray]) -> csr_matrix:
        matrix = csr_matrix((points, basis.N))
        for dofs, (function,) in zip(basis.element_dofs, basis.basis, strict=True):
            columns = np.broadcast_to(dofs[:, None], rows.shape)
            entries = np.broadcast_to(evaluate(function), rows.shape).ravel(), (rows.ravel(), columns.ravel())
            matrix = matrix + csr_matrix(entries, shape=matrix.shape)
        return matrix

    area = COPIES * basis.dx.ravel()
    sides = np.where(of_beam, *narrow_sides(sink))[:, None]
    under = ~of_oxide[:, None] if underside_bare(sink) else 0.0
    bare = COPIES * (basis.dx * (1.0 + under + sides)).ravel()
    beam, above = (np.repeat(mask, basis.dx.shape[1]) for mask in (of_beam, of_oxide))
    quadrature = Points(
        at_points(np.asarray), (at_points(lambda f: f.grad[0]), at_points(lambda f: f.grad[1])),
        area, area * above, 1.0 * above, area * ~above, bare, area, area * above, heat * area * beam, beam,
    )  # fmt: skip
    return Following(layer, (quadrature,), basis.N, open=(quadrature,))


def narrow_sides(sink: Sink) -> tuple[float, float]:
    """The area of the bare narrow sides of the beam, and of the pads, over that of their tops."""
    beam, pad = sink.width, sink.pad_width
    pads = 2 * sink.pad_length + max(pad - beam, 0.0) + (pad if sink.electrodes == "beam-end" else 0.0)
    along = 2 * sink.row_length + 2 * max(beam - pad, 0.0)
    return along * sink.thickness / (sink.row_length * beam), pads * sink.thickness / (sink.pad_length * pad)


def underside_bare(sink: Sink) -> bool:
    """Whether the underside radiates where there is no oxide: a gas over a substrate covers it in 3D."""
    return not (sink.gap_gas_conductivity and sink.substrate_thickness is not None)
