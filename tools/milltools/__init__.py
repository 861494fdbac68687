"""Python tools around millsim: the `mill` command, and the one reader of its output file.

Sub-commands are modules (`__main__.py` lists them); `runfile.Run` reads a run; `errors.UserError` is the one
way to say that the user has to mend something.
"""
