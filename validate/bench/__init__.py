"""Run time against error: `validate bench`. Entries run in processes of their own, in turns, at one scene."""
