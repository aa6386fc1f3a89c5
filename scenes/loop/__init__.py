"""Two heated films held at one temperature by sampled controllers, whatever model the films' surroundings come from.

The 1D model and the 3D one each hand over a `loop.modal.Modal`; what samples, clamps, steps and judges it is one code.
It stands beside neither of them, for they never see each other.
"""
