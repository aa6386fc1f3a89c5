"""A user's own traces, from COMSOL, a text table or ngspice, as `compare.against` takes them.

``tables`` and ``raw`` hold what a file says; ``quantities`` says which column is which quantity of the sink, ``runs``
what the user says of them and which run is the scene's; ``read`` puts these together.
"""
