"""The commands of `validate`, one file each: `describe` gives a parser its texts and options, `run` does the work.

Only the module of the command that is asked for gets imported.
"""

COMMANDS = {
    "sink": "compare the 1D model of the active sink with 3D",
    "device": "simulate the whole sensor in 1D and check what the paper says of it",
    "solve": "solve any scene of boxes, or on a mesh file, in 3D",
    "sweep": "compare at many designs: keys that vary, on a grid or sampled, on one machine or a cluster",
    "map": "find the line over two keys on which the 1D model leaves a tolerance",
    "view": "look at the 3D fields of a run, or write pictures and films of them",
    "verify": "verify the code: orders, exact solutions, benchmarks, a second code",
    "stress": "test numerical stability and robustness",
    "bench": "run time against error, beside other programs",
    "scene": "print a built-in scene as TOML",
    "completion": "print what a shell needs to complete this command",
}
