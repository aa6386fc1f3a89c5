"""The whole sensor in 3D under its controllers: a few states of the heat problem, in the closed loop of both models."""
