"""Fields for pictures and files: temperature, potential, current density and heat of the whole structure."""
