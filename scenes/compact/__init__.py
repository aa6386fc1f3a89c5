"""Compact models: a few states that stand for a whole structure, for use elsewhere.

What runs and writes one stands here, apart from the numerics that make it.
"""
