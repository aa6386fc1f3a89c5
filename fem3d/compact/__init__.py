"""Compact models of any scene: its 3D problem projected on a few fields, with every input a channel."""
