"""What can go wrong in a solver beside what `scenes.errors` has, with one clear sentence."""

from scenes.errors import NumericsError as NumericsError


class ConvergenceError(NumericsError):
    """An iteration doesn't converge, which no property of the scene explains."""
