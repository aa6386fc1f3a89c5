"""The whole sensor: runs of the 1D device model, checks of what the paper says of it, its Figures 9 to 13."""

from compare.callable_package import make_callable

make_callable(__name__)
