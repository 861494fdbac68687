"""`import milltools`: runs and results for scripts and notebooks; docs/python.md is its page.

`launch.run` starts millsim, `result.Result` is what comes out: tables of pandas (`tables`), arrays of xarray that are read when they are
used (`arrays`), numbers with their errors (`measurement`), words and pages about it (`show`). `decks` are decks as dictionaries.
"""
