"""Data of other programs and instruments, as `compare.against` takes them.

``text`` and ``raw`` read the columns of a file, ``match`` picks the run of the scene and the quantity of each column,
and ``read`` puts these together.
"""
