"""The plan of a study, and the table for its rows."""
