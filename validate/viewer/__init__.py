"""`validate view`: the fields of a run in pyvista, on screen or into pictures and films.

``source`` reads the files and holds the current view and the effect of each key, ``stage`` draws the view, and
``window`` runs the process that owns the graphics.
"""
