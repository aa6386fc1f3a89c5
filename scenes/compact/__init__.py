"""Compact models: a few states that stand for a whole structure, for use elsewhere.

Either kind of model makes one; what runs it and writes it is one code, beside neither of them.
"""
