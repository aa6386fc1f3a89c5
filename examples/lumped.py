"""A lumped model of the hot plate: one mean rise, an exponential, a parabola between the clamps. Run as a program it
writes its values as lumped.csv."""

import numpy as np
from scipy.integrate import solve_ivp


def hotplate(scene, times):
    p = scene["parameters"]
    nitride, platinum = scene["material"]
    conditions = {condition["name"]: condition for condition in scene["boundary"]}
    plate, film = p["w"] * p["t"], p["b"] * p["film"]  # cross sections, m2
    conducts = nitride["thermal_conductivity"] * plate + platinum["thermal_conductivity"] * film  # W m/K
    ends = 12 * conducts / p["L"]  # W/K from the mean of a parabola to both clamps
    air = conditions["air"]["convection"]["coefficient"] * (p["w"] - p["b"]) * p["L"]  # W/K
    heat_capacity = p["L"] * (  # J/K
        nitride["density"] * nitride["specific_heat"] * plate + platinum["density"] * platinum["specific_heat"] * film
    )
    cold = platinum["resistivity"] * p["L"] / film  # ohm
    drive = conditions["drive"]["voltage"]

    def resistance(rise):
        return cold * (1 + platinum["temperature_coefficient"] * rise)

    def slope(time, rise):
        volts = np.interp(time, drive["times"], drive["values"])
        return (volts**2 / resistance(rise) - (ends + air) * rise) / heat_capacity

    solution = solve_ivp(slope, (0.0, times[-1]), [0.0], t_eval=times, max_step=1e-5, rtol=1e-8)
    rise = solution.y[0]
    return {
        "heater": 293.15 + 1.5 * rise,
        "current": np.interp(times, drive["times"], drive["values"]) / resistance(rise),
        "heat to the left": -ends / 2 * rise,
    }


if __name__ == "__main__":
    from scenes.free import as_dict
    from scenes.loading import load

    times = np.unique(np.append(np.linspace(0, 4e-3, 801), [1e-3 + 1e-9, 2e-3 + 1e-9, 3e-3 + 1e-9]))
    values = hotplate(as_dict(load("hotplate")), times)
    names = ["time (s)", "heater (K)", "current (A)", "heat to the left (W)"]
    table = np.column_stack([times, *values.values()])
    np.savetxt("lumped.csv", table, delimiter=",", header=",".join(names), comments="", encoding="utf-8")
