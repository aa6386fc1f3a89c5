"""Tetrahedra and hexahedra of first or second order with named groups, read from the files of mesh generators."""
