"""Reports of runs: sections and tables for the terminal and the page, and entries of summary.json."""
