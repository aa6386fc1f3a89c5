"""Finite-element spaces: the weak forms, functions on bricks and mesh files, integrals, where a scene lies on cells."""
