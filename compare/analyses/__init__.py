"""The analyses of a run, in the order in which they are run and reported."""

from typing import Any

from compare.analyses.against import Against, Validation
from compare.analyses.base import Analysis
from compare.analyses.calibration import Calibration
from compare.analyses.export import CompactExport
from compare.analyses.left_out import LeftOutStudy
from compare.analyses.sensitivities import Sensitivity, UncertainInputs
from compare.analyses.why import Why
from compare.options import Options

ANALYSES: list[Analysis[Any]] = [
    Calibration(), Why(), LeftOutStudy(), UncertainInputs(), Sensitivity(), Against(), Validation(), CompactExport(),
]  # fmt: skip


def chosen(options: Options) -> list[Analysis[Any]]:
    """Return the analyses that the options ask for."""
    return [analysis for analysis in ANALYSES if analysis.asked(options)]
