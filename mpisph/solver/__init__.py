"""The state of a run, its start and one step of it."""
