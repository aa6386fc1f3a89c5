"""`validate view`: fields and scenes in pyvista, on screen or into pictures and films.

``source`` reads the fields, ``stage`` draws them, ``boxes`` draws a scene, and ``window`` runs the process that owns
the graphics.
"""
