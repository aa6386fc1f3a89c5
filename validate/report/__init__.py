"""Files of a run: the page, summary.json, traces, figures, fields, and the results folder."""
