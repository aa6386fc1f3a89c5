"""Share the reactions at given temperatures or voltages among the boundaries that give them.

The reaction of a function v at given values is int q v, q being the flux through all the boundaries there. A boundary
that touches no other has the sum of its reactions. Where boundaries of one value touch, q is projected on the functions
of both: with the mass matrix M of their faces and the loads b_i = int_i v of boundary i, the flux through i is
b_i . M^-1 r, so that M^-1 b_i are its shares of the reactions r; the shares of all add up to one.

Where they meet at an angle, an edge's own reaction belongs to the function with a value on the edge and as small as
possible elsewhere: e minus the M-projection of e on the functions beside the edge.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.sparse import csc_array
from scipy.sparse.linalg import splu

from fem3d.spaces.integrals import FaceIntegrals
from fem3d.spaces.sparse import submatrix
from scenes.model import Value


def share_reactions(
    names: Sequence[str], values: Sequence[Value], faces: Sequence[FaceIntegrals], unit: np.ndarray
) -> tuple[dict[str, np.ndarray], csc_array]:
    """Share reactions among boundaries of given values on some faces.

    ``unit`` (functions,) are the coefficients of the constant 1. Where values differ the later boundary gives the
    value, and takes the reaction. Returns for each boundary its part (functions,) of the reaction of each function, and
    (functions, functions) with the edge's own part in a row for each function where boundaries meet at an angle.
    """
    shares = {name: np.where(face.functions, unit, 0.0) for name, face in zip(names, faces, strict=True)}
    edges = csc_array((len(unit),) * 2)
    count = np.sum([face.functions for face in faces], axis=0) if faces else np.zeros(len(unit))
    if not (count > 1).any():
        return shares, edges
    # The normals of faces sum to less than 0.95 of their lengths: a bend of 36 degrees.
    normals = [face.normals() for face in faces]
    lengths = np.sum([np.linalg.norm(n, axis=1) for n in normals], axis=0)
    bent = (count > 1) & (np.linalg.norm(np.sum(normals, axis=0), axis=1) < 0.95 * lengths)
    last = np.max([np.where(face.functions, i, -1) for i, face in enumerate(faces)], axis=0)
    for value in dict.fromkeys(values):
        group = [i for i, other in enumerate(values) if other == value]
        if len(group) > 1:
            functions = np.flatnonzero(np.any([faces[i].functions for i in group], axis=0))
            mass = submatrix(csc_array(sum(faces[i].mass_of() for i in group)), functions)
            solve = splu(mass).solve
            for i in group:
                shares[names[i]][functions] = solve(faces[i].load()[functions])
            edges = csc_array(edges + _edges(mass, functions, bent))
        for i in group:
            # Beside other given values the remaining shares would not add up to one.
            shares[names[i]][faces[i].functions & ~np.isin(last, group)] = 0.0
    return shares, edges


def _edges(mass: csc_array, functions: np.ndarray, bent: np.ndarray) -> csc_array:
    """(all functions, all functions): for each of the ``functions`` where ``bent`` (all functions,) the function as
    small as possible elsewhere: e minus its projection on the other functions, by their ``mass``."""
    at, rest = np.flatnonzero(bent[functions]), np.flatnonzero(~bent[functions])
    rows = np.zeros((len(at), len(functions)))
    if len(at):
        beside = splu(submatrix(mass, rest)).solve(csc_array(mass[rest])[:, at].toarray())
        rows[:, at], rows[:, rest] = np.eye(len(at)), -beside.T
    pairs = np.repeat(functions[at], len(functions)), np.tile(functions, len(at))
    return csc_array((rows.ravel(), pairs), (len(bent),) * 2)
