"""The whole sensor: runs of the 1D device model, checks of what the paper says of it, its Figures 9 to 13."""
