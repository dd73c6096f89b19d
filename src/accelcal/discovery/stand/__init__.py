"""The stand or the unit: whose each effect is, over several units of one stand."""
