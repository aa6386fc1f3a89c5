"""Shares of the heat, or the current, that enters where boundaries of given values meet.

The reaction of a function v at given values is int q v, q being the flux through all the boundaries there. A boundary
that touches no other has the sum of its reactions. Where boundaries of one value touch, q is projected on the functions
of both: with the mass matrix M of their faces and the loads b_i = int_i v of boundary i, the flux through i is
b_i . M^-1 r, so that M^-1 b_i are its shares of the reactions r; the shares of all add up to one.

Where they meet at an angle, an edge's own reaction belongs to the function with a value on the edge and as small as
possible elsewhere: e minus the M-projection of e on the functions beside the edge.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.sparse import csc_array, diags_array
from scipy.sparse.linalg import splu

from fem3d.problems.cholesky import part

# Faces pass for one plane where their normals sum to at least this fraction of their lengths (a bend of 36 degrees).
PLANE = 0.95


@dataclass(frozen=True, eq=False)
class SharedReactions:
    """``shares``: for each boundary its part (functions,) of the reaction of each function; ``edges`` (functions,
    functions): a row for each function on an edge where boundaries meet at an angle, the edge's own part."""

    shares: dict[str, np.ndarray]
    edges: csc_array

    @staticmethod
    def of(names: Sequence[str], values: Sequence[Any], faces: Sequence[Any], unit: np.ndarray) -> SharedReactions:
        """For boundaries of given values on some faces; ``unit`` (functions,) are the coefficients of the constant 1.
        Where values differ the later boundary gives the value, and takes the reaction."""
        shares = {name: np.where(face.functions, unit, 0.0) for name, face in zip(names, faces, strict=True)}
        edges = csc_array((len(unit),) * 2)
        count = np.sum([face.functions for face in faces], axis=0) if faces else np.zeros(len(unit))
        if not (count > 1).any():
            return SharedReactions(shares, edges)
        bent = (count > 1) & _at_an_angle(faces)
        last = np.max([np.where(face.functions, i, -1) for i, face in enumerate(faces)], axis=0)
        for value in dict.fromkeys(values):
            group = [i for i, other in enumerate(values) if other == value]
            if len(group) > 1:
                projection = _Projection.on([faces[i] for i in group])
                for i in group:
                    shares[names[i]][projection.functions] = projection.coefficients(faces[i].load())
                edges = csc_array(edges + projection.edges(bent))
            for i in group:
                # Beside other given values the remaining shares would not add up to one.
                shares[names[i]][faces[i].functions & ~np.isin(last, group)] = 0.0
        return SharedReactions(shares, edges)


def _at_an_angle(faces: Sequence[Any]) -> np.ndarray:
    """(functions,): where the normals of faces sum to less than their lengths."""
    normals = [face.normals() for face in faces]
    lengths = np.sum([np.linalg.norm(n, axis=1) for n in normals], axis=0)
    bent: np.ndarray = np.linalg.norm(np.sum(normals, axis=0), axis=1) < PLANE * lengths
    return bent


@dataclass(frozen=True, eq=False)
class _Projection:
    """Projection on the ``functions`` (n,) of some faces, by their mass matrix scaled to a unit diagonal: ``mass`` =
    S M S with ``scale`` the diagonal of S."""

    functions: np.ndarray
    mass: csc_array
    scale: np.ndarray

    @staticmethod
    def on(faces: Sequence[Any]) -> _Projection:
        functions = np.flatnonzero(np.any([face.functions for face in faces], axis=0))
        mass = csc_array(sum((face.mass() for face in faces[1:]), faces[0].mass())[functions][:, functions])
        scale = 1 / np.sqrt(mass.diagonal())
        return _Projection(functions, csc_array(diags_array(scale) @ mass @ diags_array(scale)), scale)

    def coefficients(self, load: np.ndarray) -> np.ndarray:
        """(n,): M^-1 of a load (functions,)."""
        coefficients: np.ndarray = self.scale * splu(self.mass).solve(self.scale * load[self.functions])
        return coefficients

    def edges(self, bent: np.ndarray) -> csc_array:
        """(functions, functions): for each function where ``bent`` (functions,) the function as small as
        possible elsewhere: e minus its projection on the other functions."""
        on_edge = bent[self.functions]
        at, rest = np.flatnonzero(on_edge), np.flatnonzero(~on_edge)
        shape = (len(bent),) * 2
        if not len(at):
            return csc_array(shape)
        rhs = csc_array(self.mass[rest] @ diags_array(1 / self.scale))[:, at]  # S M
        beside = splu(part(self.mass, rest)).solve(rhs.toarray())
        rows = np.zeros((len(at), len(self.functions)))
        rows[:, at], rows[:, rest] = np.eye(len(at)), -(self.scale[rest, None] * beside).T
        pairs = np.repeat(self.functions[at], len(self.functions)), np.tile(self.functions, len(at))
        return csc_array((rows.ravel(), pairs), shape)
