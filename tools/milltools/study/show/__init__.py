"""What a study found, as text, pictures and a page."""
