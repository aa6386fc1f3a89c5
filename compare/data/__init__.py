"""Data of other programs and instruments, as `compare.against` takes them.

``text`` and ``raw`` read the columns of a file, ``runs`` picks the run of the scene, ``targets`` and ``match`` find the
quantity of each column, and ``read`` puts these together.
"""

from compare.data.read import read

__all__ = ["read"]
