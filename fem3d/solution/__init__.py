"""The coupled steady state and the transient, in full and in reduced spaces."""
