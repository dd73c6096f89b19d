"""The missing effect: where model and readings disagree, its name, and how sure that is.

`discover` goes through these modules:

1. `faults` finds readings that contradict their replicates and strokes in a wrong order, and mends
   the record.
2. `comparison` fits the model that is taken for granted (`base`) and whitens what it leaves by the
   covariance of the `noise` of the replicates and the declared errors.
3. `instance` turns the effects of the catalogue into directions in that `space`, all of `columns`.
4. `family` is one test over all of them, with a false-alarm rate from simulated noise. `search`
   finds the smallest sets of effects beside which nothing disagrees, each an `explanation`.
5. `parameters` tells their sizes, `solution` what they change in the coefficients, and how well the
   readings are predicted that were not fitted, `factors` where in the test the disagreement is.
6. `unexplained` tells what no effect of the catalogue explains, by the patterns of `unnamed`, as
   what comes and goes or wanders.
7. `prospects` tells what the test cannot show, what looks alike in it and what to measure next,
   `doubts` what else a reader must know, and what else explains the readings.

`new_record` holds a new record against a calibration, `two_calibrations` another calibration.
`stand` searches several units of one stand at once. `in_use` takes found effects out of readings,
and makes them ready to be simulated.
"""
