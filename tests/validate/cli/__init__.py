import html
import json
import re
from pathlib import Path
from typing import Any

import pytest


def summary(folder: str | Path = "results/sink-1V") -> dict[str, Any]:
    """Return the summary of a run; no number is infinite or missing."""
    return json.loads(Path(folder, "summary.json").read_text(encoding="utf-8"), parse_constant=pytest.fail)


def page_text(folder: str | Path) -> str:
    """Return the text of a run's report.html, in one line."""
    page = Path(folder, "report.html").read_text(encoding="utf-8")
    return " ".join(html.unescape(re.sub(r"<[^>]+>", " ", page)).split())
