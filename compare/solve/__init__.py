"""A run of any free 3D scene: solved, written to a folder, and told in the terminal."""
