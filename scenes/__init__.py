"""What is to be solved: materials, boxes, boundaries, drive, probes. No numerics."""

from scenes.loading import load as load
