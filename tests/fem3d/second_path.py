"""The quantities of a sink from the second path's fields (`validate.verify.reference`)."""

import numpy as np

from fem3d.runs import sink_quantities
from validate.verify import reference


def quantities(sink, part, full, rise, rate=None):
    """Those of `sink_quantities.steady` of the whole sink, from the part that was solved, at a rise and its rate."""
    read = outputs(full, rise, np.zeros_like(rise) if rate is None else rate)
    whole = {name: value for name, value in read.items() if name.startswith("probe:")}
    for name, flow in part.flows.items():
        for kind, factor in (("flow", flow.heat), ("current", flow.current)):
            if f"{kind}:{flow.boundary}" in read:
                whole[f"{kind}:{name}"] = factor * read[f"{kind}:{flow.boundary}"]
    whole |= {
        f"joule:{name}": n * read[f"joule:{name}"] for name, n in part.box_copies.items() if f"joule:{name}" in read
    }
    whole["power"] = part.copies * read["power"]
    return sink_quantities.steady(sink, {name: np.array(value) for name, value in whole.items()})


def outputs(full, rise, rate):
    """Means of the probes (K above the start), heat flows into the solid (W), currents, Joule heats and power."""
    joule, phi, current = full.heated(rise)
    entering = full.stiffness @ rise + full.mass @ rate - full.load - joule
    read = {"power": float(phi @ current)}
    for b in full.scene.boundaries:
        if b.kind == "voltage":
            read[f"current:{b.name}"] = float(current[full.held[b.name][0]].sum())
        elif b.kind == "temperature":
            read[f"flow:{b.name}"] = float(entering[full.held[b.name][0]].sum())
        else:
            matrix, load = reference.film(full.basis, b, full.scene.initial_temperature)
            read[f"flow:{b.name}"] = float((load - matrix @ rise).sum())
    for probe in full.scene.probes:
        read[f"probe:{probe.name}"] = float(reference.mean(full.basis, probe) @ rise)
    # The heat of a box, from the potential and the resistivity on its elements.
    elements, part, _ = full.conductors
    rho = (full.resistivity[0] + full.resistivity[1] * np.asarray(full.basis.interpolate(rise)))[elements]
    heat = ((part.interpolate(phi).grad ** 2).sum(axis=0) / rho * part.dx).sum(axis=1)
    for number in np.unique(full.owner[elements]):
        read[f"joule:{full.scene.boxes[number].name}"] = float(heat[full.owner[elements] == number].sum())
    return read
