"""Toile's batches on a Ray cluster: each subject is a task that runs the program `toile`."""
