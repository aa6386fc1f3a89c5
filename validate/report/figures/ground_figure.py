"""Figure 14: what a lead to ground that sink and sensor share does to both."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from compare.device_checks import METER_POWER, METER_RESISTANCE
from compare.outcome import Outcome
from compare.report.checks import drawn, with_mu
from reduced1d.device.closed_loop import ground_effects
from scenes.device import Device
from scenes.formats import quantity
from validate.report.figures import INK, LAYERS
from validate.report.figures.drawing import legend, logarithmic, new_figure


def shared(outcome: Outcome[Device]) -> Figure:
    """Left how far the films are off the temperatures without the lead, against its resistance, with the leads from
    which on the paper's meter tells; right between which outer temperatures both are held."""
    device = outcome.scene
    ground = ground_effects(device, METER_POWER, METER_RESISTANCE)
    checks = [drawn(check) for check in outcome.checks if check.id == "fig14_ground"]
    figure = new_figure(9.5, 5.0, "Figure 14: a lead to ground that sink and sensor share", checks, bottom=0.95)
    off, reach = figure.subplots(1, 2, gridspec_kw={"wspace": 0.28})
    lead = np.array([each.resistance_ohm for each in ground.leads]) * 1e3
    for film in ("sensor", "sink"):
        # Where no outer temperature lets both films be held there is no state to be off by.
        values = np.abs([getattr(each, f"{film}_off_K") for each in ground.leads])
        values = np.where(np.isnan([each.highest_K for each in ground.leads]), np.nan, values)
        off.plot(lead, values, "o-", color=LAYERS[film], label=f"{film}, 1D, off the temperature without it")
        if outcome.device_3d is not None:
            three = outcome.device_3d.ground
            place = [each.resistance_ohm * 1e3 for each, _ in three]
            values = np.abs([getattr(each, f"{film}_off_K") for each, _ in three])
            off.plot(place, values, "x", ms=9, color="black", label="3D" if film == "sensor" else None)
    logarithmic(off, "x")
    logarithmic(off, "y")
    off.set(xlabel="resistance of the lead (mohm)", ylabel="off by (K)")
    low, high = (np.array([getattr(each, f"{end}_K") for each in ground.leads]) for end in ("lowest", "highest"))
    reach.fill_between(lead, low, high, color=LAYERS["polymer"], alpha=0.35, label="both films are held")
    reach.plot(lead, high, "o", color=INK, ms=4)
    external = device.external
    for outer, style in ((external.initial_temperature, ":"), (external.final_temperature, "--")):
        reach.axhline(outer, color=INK, lw=1.0, ls=style, label=f"{outer:g} K outside")
    logarithmic(reach, "x")
    reach.set(xlabel="resistance of the lead (mohm)", ylabel="outer temperature (K)", xlim=off.get_xlim())
    limits = " and ".join(quantity(each, "ohm", 3) for each in (ground.by_power_ohm, ground.by_resistance_ohm))
    off.set_title(with_mu(f"the paper's meter tells power and resistance from {limits} on"), fontsize=9, color=INK)
    legend(figure, off, reach, columns=3, fontsize=9)
    return figure
