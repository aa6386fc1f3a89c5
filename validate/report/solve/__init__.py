"""What is told, drawn and written of a run of a free scene: probes, traces, fields."""
