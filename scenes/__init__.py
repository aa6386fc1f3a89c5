"""What is to be solved: materials, boxes, boundaries, drive, probes. No numerics."""

from scenes.any import load as load

__all__ = ["load"]
