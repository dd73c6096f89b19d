"""Gates: checks that warn before anyone believes a fit.

Each looks at one way in which a tumble test goes wrong without the fit noticing. A gate passes,
warns, or says why it could not look.
"""
