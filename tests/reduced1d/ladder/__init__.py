"""Tests of the ladder of reductions and of their export."""
