"""The 3D electro-thermal model in subpackages; each imports only from the preceding subpackages:

`spaces` (functions on cells, integrals), `problems` (matrices, their factors), `solution` (steady state,
transient), `results` (probes, flows, fields), `adaptivity` (errors, refinement), and `runs` (from a scene to a result,
its derivatives, the device, compact models).
"""
