"""The files of a run: written whole, read back with their faults named."""
