"""Studies: many runs of millsim over ranges of deck keys, in one table. docs/studies.md says how they are written and kept.

deck.py reads the study deck, ranges.py its [vary], designs.py makes the plan, job.py is one run, drive.py sends jobs through an
executor of executors.py, table.py keeps the rows. docs/optimize.md: search.py chooses the designs one by one, by gp.py and acquisition.py.
"""
