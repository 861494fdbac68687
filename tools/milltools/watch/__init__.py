"""`mill watch`: a page that shows a run while it goes on."""
