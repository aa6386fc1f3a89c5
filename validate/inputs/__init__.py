"""How sure the inputs are: how both models follow them, and what that makes of their uncertainties.

Nothing here is imported unless it is asked for.
"""
