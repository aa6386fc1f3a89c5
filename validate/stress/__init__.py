"""Numerical stability and robustness, by `validate stress`: extremes, drives, time steps, and random scenes."""
