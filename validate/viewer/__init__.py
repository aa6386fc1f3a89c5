"""`validate view`: the fields of a run in pyvista, on screen or into pictures and films.

``source`` finds the files and paints the 1D model on the same points, ``state`` is what is shown at the
moment and what each key makes of it, ``stage`` draws it, ``window`` is the process that owns the graphics, and
``start`` runs that process and says what became of it.
"""
