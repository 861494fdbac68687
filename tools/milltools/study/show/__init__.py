"""The results of a study as text, pictures and an HTML page."""
