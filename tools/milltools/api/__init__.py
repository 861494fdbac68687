"""`import milltools`: runs, results and studies for scripts and notebooks; docs/python.md is its page.

`launch.run` starts millsim, `result.Result` is what comes out: tables of pandas, arrays of xarray that are read when
they are used (`arrays`, with the log of impacts), words and numbers with their errors (`words`) and pictures
(`plots`) of it. `studies` are sweeps and searches, `decks` decks as dictionaries.
"""
