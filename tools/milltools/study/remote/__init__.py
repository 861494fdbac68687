"""The places where the runs of a study are done: cores of this machine, Dask, Slurm."""
