"""The current view, as a value, and the keys that change it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

QUANTITIES = {
    "rise": ("rise", "K"),
    "temperature": ("temperature", "K"),
    "potential": ("potential", "V"),
    "current_density": ("current density", "A/m2"),
    "heat_source": ("heat source", "W/m3"),
}
"""What can be shown: the data's name, its label and unit."""

_CUTS = {"": "x", "x": "y", "y": "z", "z": ""}
FACTORS = (1, 2, 5, 10, 20, 50, 100, 200, 500, 1000)


@dataclass(frozen=True)
class View:
    """The state of the viewer.

    ``step`` of ``steps`` states; ``factor`` exaggerates the thickness; ``cut`` is the axis ("x", "y", "z" or none) of
    the clipping plane and ``place`` where it is, as a part of the extent; ``compare`` shows 3D, 1D and difference.
    ``own_scale`` colours each time by its own range; else all have one, so that they can be compared.
    """

    quantities: tuple[str, ...]
    steps: int
    factor: float
    step: int = 0
    quantity: str = "rise"
    compare: bool = False
    can_compare: bool = False
    edges: bool = False
    cut: str = ""
    place: float = 0.5
    probe: bool = False
    own_scale: bool = False
    keys: bool = True
    playing: bool = False

    def at(self, step: int) -> View:
        """At another state, from the first after the last."""
        return replace(self, step=step % self.steps)


def _next_quantity(view: View) -> View:
    k = view.quantities.index(view.quantity)
    return replace(view, quantity=view.quantities[(k + 1) % len(view.quantities)])


def _moved(view: View, by: float) -> View:
    return replace(view, place=round(min(max(view.place + by, 0.02), 0.98), 4)) if view.cut else view


def _stretched(view: View, up: bool) -> View:
    others = [f for f in FACTORS if (f > view.factor if up else f < view.factor)]
    return replace(view, factor=float((others[0] if up else others[-1]) if others else view.factor))


def _compare(view: View) -> View:
    return replace(view, compare=not view.compare, quantity="rise") if view.can_compare else view


def _play(view: View) -> View:
    return replace(view, playing=not view.playing) if view.steps > 1 else view


def _switch(name: str) -> Callable[[View], View]:
    def switched(view: View) -> View:
        turned: dict[str, Any] = {name: not getattr(view, name)}
        return replace(view, **turned)

    return switched


KEYS: dict[str, tuple[str, str, Callable[[View], View]]] = {
    "space": ("space", "play, stop", _play),
    "Right": ("right", "later", lambda view: view.at(view.step + 1)),
    "Left": ("left", "earlier", lambda view: view.at(view.step - 1)),
    "t": ("t", "next quantity", _next_quantity),
    "c": ("c", "3D, 1D and difference", _compare),
    "x": ("x", "clip across x, y, z, not", lambda view: replace(view, cut=_CUTS[view.cut], place=0.5)),
    "bracketright": ("]", "plane on", lambda view: _moved(view, 0.05)),
    "bracketleft": ("[", "plane back", lambda view: _moved(view, -0.05)),
    "l": ("l", "line probe", _switch("probe")),
    "a": ("a", "colours: all times, this", _switch("own_scale")),
    "m": ("m", "mesh edges", _switch("edges")),
    "period": (".", "thicker", lambda view: _stretched(view, True)),
    "comma": (",", "thinner", lambda view: _stretched(view, False)),
    "k": ("k", "these keys", _switch("keys")),
}
"""By VTK's name of a key: label, words, function. VTK itself uses q (close the window) and r (reset the camera)."""


def keys_text(view: View, columns: int) -> str:
    """The keys that do something here, in so many columns, read downwards."""
    idle = set()
    if view.steps < 2:
        idle |= {"space", "Right", "Left", "a"}
    if not view.can_compare:
        idle |= {"c"}
    if len(view.quantities) < 2:
        idle |= {"t"}
    entries = [f"{shown:<6} {what}" for name, (shown, what, _) in KEYS.items() if name not in idle]
    entries += ["r      reset the camera", "q      close"]
    rows = -(-len(entries) // columns)
    return "\n".join("".join(f"{entry:<34}" for entry in entries[row::rows]).rstrip() for row in range(rows))


def title(view: View, name: str, time: float | None) -> str:
    """Return the title of a view, in one line that states the exaggeration."""
    label = "rise in 3D and 1D, and the difference" if view.compare else QUANTITIES[view.quantity][0]
    when = "steady" if time is None else f"{time * 1e3:.4g} ms"
    drawn = f"thickness drawn x{view.factor:g}" if view.factor != 1 else "true proportions"
    clip = f", clipped across {view.cut}" if view.cut else ""
    return f"{name}: {label}, {when}, {drawn}{clip}"
