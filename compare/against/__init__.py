"""A user's own traces, from COMSOL, a plain CSV or ngspice, against the 3D model's.

``columns`` holds what a file says, as the readers ``comsol``, ``plain`` and ``ngspice`` find it; ``quantities`` says
which column is which quantity of the sink; ``data`` puts the two together; ``checks`` compares, on time values.
"""
