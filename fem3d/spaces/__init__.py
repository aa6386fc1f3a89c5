"""Finite-element spaces: the weak forms, the functions on bricks and mesh files, integrals, and where a scene lies on cells."""
