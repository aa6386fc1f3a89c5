"""The 3D model on a mesh of tetrahedra or hexahedra that is given: the same problem as on boxes, the same reduced
dynamics, and errors estimated between polynomial degrees and, where that is cheap, a uniform refinement."""
