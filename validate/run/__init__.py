"""A run, from what is asked for to what was found: the plan, both models, the comparison and what else was asked for.
Nothing is written here.
"""
