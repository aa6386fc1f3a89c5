"""report.html: one self-contained page about a run, for reading, printing and turning its field.

Made from a run's summary (the document of summary.json) and the files beside it. Sections without content are left
out, so that any kind of run can have a page.
"""
