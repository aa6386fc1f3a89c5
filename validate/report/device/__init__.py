"""What is told, drawn and written of a run of the device: Figures 9 to 13, tables, summary."""
