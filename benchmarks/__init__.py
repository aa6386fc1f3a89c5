"""Robustness and run time: the tables of `validate stress` and `validate bench`."""
