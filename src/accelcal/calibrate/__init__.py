"""From records to calibrations: the rooms below, wired together.

`fit` takes one record, or many. It makes a `plan` of records that can be solved
together and calibrates it as a `stack`; `of_record` takes one calibration out of it.
"""
