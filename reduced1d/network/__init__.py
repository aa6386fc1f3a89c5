"""The network that one makes by hand, of any union of boxes: every box is a line along its longest side, its
temperature one over the cross-section, and boxes that touch are joined; heat, and current on the lines that conduct.

Two boxes are joined over the interval of each line that the face covers: a face at a line's end with no resistance of
its own, a face at its side with half the thickness, d/(2 k A), so that a slab crossed by heat has its whole thickness;
and conditions likewise. Lines that run alike and touch along their sides exchange heat point by point (a fin), others
by the means over their intervals. Films, fluxes, sources and Joule heat act per length.
"""

from __future__ import annotations

from reduced1d.network.solution import solve

__all__ = ["solve"]
