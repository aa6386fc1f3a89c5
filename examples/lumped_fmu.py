"""The hot plate's lumped model as an FMU: `python -m pythonfmu build -f examples/lumped_fmu.py` writes HotPlate.fmu."""

from pythonfmu import Fmi2Causality, Fmi2Slave, Real

L, w, t, b, film = 200e-6, 100e-6, 2e-6, 10e-6, 0.5e-6
ENDS, AIR = 12 * (20 * w * t + 70 * b * film) / L, 200 * (w - b) * L  # W/K
HEAT_CAPACITY = L * (3100 * 700 * w * t + 21450 * 133 * b * film)  # J/K
COLD = 1.1e-7 * L / (b * film)  # ohm
SWITCHED, STEP = (1e-3, 2e-3, 3e-3), 2e-6  # s


class HotPlate(Fmi2Slave):
    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.rise, self.volts = 0.0, 0.2
        for name in ("heater", "current", "heat_to_the_left"):
            self.register_variable(Real(name, causality=Fmi2Causality.output))

    heater = property(lambda self: 293.15 + 1.5 * self.rise)
    current = property(lambda self: self.volts / (COLD * (1 + 3e-3 * self.rise)))
    heat_to_the_left = property(lambda self: -ENDS / 2 * self.rise)

    def slope(self, rise):
        return (self.volts**2 / (COLD * (1 + 3e-3 * rise)) - (ENDS + AIR) * rise) / HEAT_CAPACITY

    def do_step(self, current_time, step_size):
        end = current_time + step_size
        while end - current_time > 1e-12:
            self.volts = 0.2 * (sum(current_time > at - 1e-12 for at in SWITCHED) % 2 == 0)
            h = min(STEP, *(at - current_time for at in (*SWITCHED, end) if at > current_time + 1e-12))
            middle = self.rise + h / 2 * self.slope(self.rise)
            self.rise += h * self.slope(middle)
            current_time += h
        return True
