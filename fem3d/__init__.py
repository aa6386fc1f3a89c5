"""The 3D electro-thermal model in rooms, each of which imports only those before it:

`spaces` (weak forms, functions on cells, integrals), `problems` (matrices, their factors), `solution` (steady state,
transient), `results` (what is read off), `adaptivity` (errors, refinement), `sensitivity` (derivatives), `runs` (from a
scene to a result), and on top `device` and `compact`.
"""
