"""Sweeps over a design space, and maps of where a reduction is within a tolerance, on Dask.

A sweep is a `Design` (which points) of a `Base` (what is solved at each), each point as `Asked`. Points are solved in
processes of their own, each row is stored when it is there, and tables, figures and a page are made of the stored rows.
"""
