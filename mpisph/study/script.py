"""Batch scripts that run a study in a job array of Slurm or PBS."""
