"""Two or more runs side by side: differences, their errors, verdicts."""
