"""A user's own traces, from COMSOL, a text table or ngspice, as `compare.against` takes them.

``columns`` holds what a file says, as the readers ``comsol``, ``text_table`` and ``ngspice`` find it; ``meanings`` is
what the user says of its columns; ``runs`` and ``parameters`` pick the run of the scene; ``quantities`` says which
column is which quantity of the sink; ``read`` puts these together.
"""
