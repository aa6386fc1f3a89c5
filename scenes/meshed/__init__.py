"""Scenes on a mesh file: its groups carry the materials, the conditions and the probes; checked against the mesh
itself only when that has been read (`meshes.groups`)."""

from scenes.meshed.model import MeshScene as MeshScene
