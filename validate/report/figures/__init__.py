"""Figures of a run of the sink, and what all figures have in common."""
