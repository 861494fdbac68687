"""What a study runs, and the table that its rows go to."""
