"""The product model of all readings, in which the temperature acts within (1), and its fit.

`model` says what it is, `errors` what is known of the readings' errors, of which those of the head
count as noise, and `fit` finds the parameters.
"""
