"""A run of any free 3D scene: solved, written to a folder, and told in the terminal."""

from compare.callable_package import make_callable

make_callable(__name__)
