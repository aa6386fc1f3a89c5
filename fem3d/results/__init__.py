"""Outputs of a solution: probes, flows, currents, traces and fields."""
