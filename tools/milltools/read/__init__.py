"""Reads decks and output files."""
