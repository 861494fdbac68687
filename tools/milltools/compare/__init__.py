"""Comparison of two or more runs: differences, their errors, verdicts."""
