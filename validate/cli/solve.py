"""Solve any scene of boxes, or on a Gmsh or Nastran mesh, in 3D: heat, current or both; steady or
over time; every probe with its estimated numerical error.

examples:
  validate scene bridge > mine.toml; validate solve mine.toml
  validate solve bridge --set "boundary.left electrode.voltage=3V" --accuracy 1e-4
  validate solve hotplate --end-time 2ms --explain
  validate solve bridge --model lumped.py:bridge
  validate solve bridge --sensitivities
  validate solve hotplate --against measured.csv --data-uncertainty 0.5K
  validate solve hotplate --export my-model --model-accuracy 1e-2

results: summary.json, traces.csv (a column per probe) and figures in
results/<scene>-<what distinguishes it>/
exit status: 0 solved, 1 a check of a model differs from what is declared, 2 bad input, 3 the numerics failed
"""

from __future__ import annotations

import argparse

from scenes.errors import SceneError
from validate.cli import common

OPTIONS = {
    "scene SCENE.toml": "a scene file, or an example: bridge, plate, hotplate",
    "--set KEY=VALUE ...": "override a key, as often as needed: run.accuracy=1e-4, boundary.NAME.voltage=2",
    "--accuracy A": "relative accuracy of every probe (default 1e-3 or the scene's)",
    "--steady": "the steady state, whatever the scene says of time",
    "--model M": "a 1D model of your own to judge: FILE.py:FUNCTION, FILE.cir (ngspice), FILE.fmu, FILE.csv, "
    "network (lines made of the boxes, as by hand), or scene for the scene's own [model]",
    "--why": "with --model network: which joint of it is to blame for what, by putting 3D's own resistance into it",
    **common.of_data('heater="T (K), Point 1", "tip rise (K)=3"', "heater"),
    "--end-time T": "over time from the start to T, such as 2ms, whatever the scene says of it",
    "--out DIR": "", "--no-figures": "", "--strict": "",
    "--fields": "write the 3D temperature fields (fem3d.pvd with .vtu files)",
    "--sensitivities": "how every probe follows each number of the scene: d ln probe / d ln key",
    **common.of_inputs("box.beam.upper.z=0.1um, boundary.drive.voltage=1%%",
                       "box.beam.lower.x,box.beam.upper.x=-1"),
    **common.OF_MODEL,
    "--explain": "", "--dry-run": "", "--quiet": "", "--json": "",
}  # fmt: skip


def run(arguments: argparse.Namespace) -> int:
    from scenes.loading import load_free as load
    from validate.run.kinds.free import reported

    if arguments.steady and arguments.end_time is not None:
        raise SceneError(f"--steady and --end-time {arguments.end_time} contradict each other: give one of them")
    until = ("run.end_time", arguments.end_time)
    settings = common.settings(arguments, ("run.steady", "true" if arguments.steady else None), until)
    if arguments.why and arguments.model != "network":
        raise SceneError("--why asks which joint of the network is to blame: give --model network with it")
    scene = load(arguments.scene, settings)
    request = common.request(arguments, scene, scene.accuracy, model=arguments.model or "")
    scene = reported(scene, request)
    data_arguments = [arguments.against, *arguments.column] if arguments.against else []
    return common.run(arguments, scene, request, settings, data_arguments, common.data_of(arguments, scene))
