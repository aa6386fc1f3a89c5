"""For a student: the paper's equations 13, 14, 16 and 18 by hand, on the 3D solution's own numbers."""

import compare
import scenes
from reduced1d.equations import anchor_series_resistance

run = compare.run(scenes.load("sink"), steady=True)
sink, steady = run.scene, run.fem3d.steady
peak, end, mean = (steady[f"{name}_rise_K"].value for name in ("peak", "end", "mean"))
k, A, L = sink.silicon.thermal_conductivity, sink.cross_section, sink.length
drop = peak - end

print("Equation 9: the rise along the beam is a parabola, dT0 [1 - 4 (y/L - 1/2)^2] + dT_end.")
profile = run.fem3d.details["profile"]
for part in (0.1, 0.25, 0.5):
    place = round(part * (len(profile["y_m"]) - 1))
    parabola = drop * (1 - 4 * (part - 0.5) ** 2) + end
    print(f"  y/L = {part:4.2f}: parabola {parabola:6.3f} K, 3D {profile['rise_K'][place]:6.3f} K")

print(f"Equation 13: its mean, 2/3 dT0 + dT_end = {2 / 3 * drop + end:.3f} K; 3D has {mean:.3f} K.")
flow = 4 * k * A * drop / L
print(f"Equation 16: the heat through an end, 4 k A dT0 / L = {flow * 1e3:.4f} mW.")
printed, measured = anchor_series_resistance(sink), steady["anchor_resistance_K_per_W"].value
print(f"Equation 14: the anchor's resistance, {printed:.1f} K/W; in 3D it is {measured:.1f} K/W.")
for name, R in (("the printed", printed), ("the 3D", measured)):
    ratio = 2 / 3 * L / (4 * k * A) / R  # the two equations above, with dT_end = R flow
    print(f"Equation 18: with {name} resistance, dT_end = {mean / (1 + ratio):.3f} K; 3D has {end:.3f} K.")
