"""`import milltools`: runs, results and studies for scripts and notebooks; docs/python.md describes it.

`launch.run` starts millsim and returns a `result.Result`. It gives tables of pandas, arrays of xarray that are read
when they are used (`arrays`, with the log of impacts), texts and numbers with their errors (`words`), and pictures
(`plots`). `studies` contains sweeps and searches, `decks` decks as dictionaries.
"""
