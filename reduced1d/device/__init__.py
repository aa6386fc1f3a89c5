"""The whole sensor in 1D: sink, insulator, sensor film, polymer and their sampled controllers."""
