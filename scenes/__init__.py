"""Scenes as data: materials, boxes, boundaries, drive, probes. No numerics. Here any scene by its name or file: a
sink, a device, or a free scene of boxes or on a mesh."""

from scenes.loading import load as load
from scenes.loading import overridden as overridden
