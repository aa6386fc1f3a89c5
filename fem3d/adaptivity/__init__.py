"""Estimated errors, and refinement of a mesh until they are within the accuracy."""
