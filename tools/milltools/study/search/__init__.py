"""The choice of the next design to run."""
