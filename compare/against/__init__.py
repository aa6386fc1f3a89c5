"""A user's own traces, from COMSOL, a plain table or ngspice, against the 3D model's.

``columns`` holds what a file says, as the readers ``comsol``, ``plain`` and ``ngspice`` find it; ``chosen`` is what the
user says of its columns; ``runs`` and ``parameters`` pick the run of the scene; ``quantities`` says which column is
which quantity of the sink; ``data`` puts these together; ``checks`` compares, on time values.
"""
