"""For a designer: how wide may the beam be for the 1D model to be right about its peak, and how to correct it?

Everything is relative to 3D, whose own numerical error is in the verdict.
"""

import compare
import scenes

VOLTAGE, TOLERANCE = 1.0, 0.05

print("width    peak 1D    peak 3D    off       anchor 3D")
for width in ("10um", "30um", "100um"):
    scene = scenes.load("sink", [f"sink.width={width}", f"checks.tolerances.fig4={TOLERANCE}"])
    run = compare.run(scene, voltage=VOLTAGE, steady=True)
    check = run.check("fig4")
    anchor = run.fem3d.steady["anchor_resistance_K_per_W"]
    print(
        f"{width:>6}  {check.predicted:7.2f} K  {check.measured:7.2f} K  {check.difference:+6.1%}  "
        f"{anchor.value:7.0f} K/W   {check.verdict}"
    )

print()
print("Where it differs, the anchor's resistance is to blame (eq 14), not the beam's profile (eq 13):")
for name in ("eq13", "eq14", "eq18_measured"):
    check = run.check(name)
    print(f"  {name:14} {check.title:22} {check.difference:+8.2%}  {check.verdict}")
