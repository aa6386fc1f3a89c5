"""`validate view`: the fields of a run in pyvista, on screen or into pictures and films.

``source`` finds the files and paints the 1D model on the same points, ``state`` is what is shown at the moment and
what each key makes of it, ``stage`` draws it, and ``window`` runs the process that owns the graphics.
"""
