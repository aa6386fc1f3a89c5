"""Traces as named columns, as traces.csv has them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

from scenes.errors import SceneError, did_you_mean, quoted

if TYPE_CHECKING:
    import numpy as np


class Columns(Mapping[str, "np.ndarray"]):
    """Arrays of equal length by name: ``columns["time_s"]``, ``columns["fem3d_peak_K"]``; empty without a transient.

    ``columns("peak_K")`` is (times, 3D, 1D) of one quantity of a sink.
    """

    def __init__(self, columns: Mapping[str, np.ndarray]) -> None:
        self._columns = dict(columns)

    def __getitem__(self, name: str) -> np.ndarray:
        if name not in self._columns:
            raise KeyError(f"no column {name!r}; there are {', '.join(self) or 'none, as there is no transient'}")
        return self._columns[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._columns)

    def __len__(self) -> int:
        return len(self._columns)

    def __call__(self, quantity: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Times (s), 3D and 1D values of a quantity of a sink: "peak_K", "end_K", "mean_K", "current_A", "power_W";
        SceneError where there is none of that name, or no transient."""
        if not self:
            raise SceneError("this run has no transient: leave out steady=True")
        known = tuple(name.removeprefix("fem3d_") for name in self if name.startswith("fem3d_"))
        if quantity not in known:
            raise SceneError(f"{quoted(quantity)} is no trace: give {', '.join(known)}{did_you_mean(quantity, known)}")
        return self["time_s"], self[f"fem3d_{quantity}"], self[f"reduced1d_{quantity}"]

    def __repr__(self) -> str:
        rows = len(next(iter(self._columns.values()), ()))
        return f"<traces, {rows} rows: {', '.join(self)}>" if self else "<no traces: no transient was solved>"

    def to_dataframe(self) -> Any:
        """The columns as a pandas DataFrame; ImportError where pandas is not installed."""
        try:
            import pandas
        except ImportError:
            raise ImportError("to_dataframe needs pandas: pip install pandas") from None
        return pandas.DataFrame(self._columns)
