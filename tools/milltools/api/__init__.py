"""`import milltools`: runs, results and studies for scripts and notebooks; docs/python.md describes it.

`launch.run` starts millsim and returns a `result.Result`. It gives tables of pandas (`impacts`: the log), arrays of
xarray that are read when they are used (`arrays`), numbers with their errors (`measurement`), texts (`words`), and
pictures (`plots`). `studies` contains sweeps and searches, `decks` decks as dictionaries.
"""
