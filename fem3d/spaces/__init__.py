"""Finite-element spaces on bricks, tetrahedra and mesh files, integrals, and the places of a scene on the cells."""
