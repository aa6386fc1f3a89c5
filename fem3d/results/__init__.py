"""What is read off a solution: probes, flows, currents, traces and fields."""
