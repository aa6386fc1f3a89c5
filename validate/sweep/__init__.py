"""Sweeps over a design space, and maps of where a reduction is within a tolerance, on Dask."""
