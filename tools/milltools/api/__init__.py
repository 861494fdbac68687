"""`import milltools`: runs, results and studies for scripts and notebooks; docs/python.md is its page.

`launch.run` starts millsim, `result.Result` is what comes out: tables of pandas, arrays of xarray that are read when they are used
(`arrays`), the log of impacts (`impacts`), numbers with their errors (`measurement`), words (`words`) and pictures (`plots`) of it.
`studies` are sweeps and searches, `decks` decks as dictionaries.
"""
