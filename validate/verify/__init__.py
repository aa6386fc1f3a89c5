"""Code verification, by `validate verify`: manufactured and exact solutions, published benchmarks, a second path."""
