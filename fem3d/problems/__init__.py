"""The discrete heat and current problems of a scene, and the factors that solve them."""
