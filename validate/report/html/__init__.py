"""report.html: one self-contained page about a run, for reading, printing and turning its field.

Made of a run's summary (the document of summary.json) and of the files beside it; says what is there and leaves out the
rest, so that any kind of run can have one.
"""
