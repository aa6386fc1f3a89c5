"""The value types of a scene on a mesh file, SI units throughout.

They stand beside those of `scenes.model`, with the name of a group of the mesh where those have corners.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from scenes.model import Material, Point, Value


@dataclass(frozen=True)
class Body:
    """The volume groups that are of one material."""

    material: Material
    groups: tuple[str, ...]


@dataclass(frozen=True)
class Source:
    """A heat source (W/m3) in every cell of a volume group; sources that overlap add up."""

    name: str
    group: str
    heat_source: Value


@dataclass(frozen=True)
class GroupBoundary:
    """A condition on a surface group: ``kind``, ``value`` and ``ambient`` as of `scenes.model.Boundary`."""

    name: str
    kind: Literal["temperature", "heat_flux", "convection", "voltage"]
    group: str
    value: Value
    ambient: Value = 293.0


@dataclass(frozen=True)
class GroupProbe:
    """What is reported at a point (m) or over a group, one of the two being ``None``.

    "temperature" (K) and "potential" (V): the mean, largest or smallest value over a volume or a surface group.
    "heat_flow" (W) and "current" (A): what enters the solid through the conditions on a surface group, or, where the
    group lies inside the solid and has none, what passes it in the direction of its faces' normals.
    """

    name: str
    at: Point | None = None
    group: str | None = None
    quantity: Literal["temperature", "potential", "heat_flow", "current"] = "temperature"
    reduce: Literal["mean", "max", "min"] = "mean"


@dataclass(frozen=True)
class MeshScene:
    """A scene on a mesh: ``file`` as the scene gives it, relative to ``folder``, in units of ``unit`` (m)."""

    name: str
    file: str
    unit: float
    bodies: tuple[Body, ...]
    sources: tuple[Source, ...]
    boundaries: tuple[GroupBoundary, ...]
    probes: tuple[GroupProbe, ...]
    initial_temperature: float = 293.0
    end_time: float = 0.02
    accuracy: float = 1e-3
    steady: bool = False
    output_times: tuple[float, ...] = ()
    folder: str = ""

    @property
    def path(self) -> Path:
        """Where the mesh is."""
        return Path(self.folder) / self.file
