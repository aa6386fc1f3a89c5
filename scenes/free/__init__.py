"""Free 3D scenes: any union of boxes with conditions and probes, read from TOML and checked before anything is solved.

`load` reads a file, `from_dict` what `as_dict` returns; `asks` says which physics a scene asks for.
"""

from scenes.free.loading import as_dict as as_dict
from scenes.free.loading import check as check
from scenes.free.loading import from_dict as from_dict
from scenes.free.loading import load as load
