"""Tumble tables with hidden effects, made reading by reading from physics; no code of accelcal.

Run with ``benchmarks`` on the path (a script in that folder has it)::

    import numpy as np
    from hidden.cases import draw
    from hidden.design import DESIGNS
    case, table = draw("backlash", np.random.default_rng(1), DESIGNS["three"], "head", s=4.0)
    case.hidden, case.truth              # ("backlash",), {"backlash": {"backlash": ...}}
    table.write("hidden.csv")            # long CSV; table.clean and .affected are noise-free

Kinds: ``"none"``, each id of `hidden.catalogue.CATALOGUE`, each name of
`hidden.strangers.STRANGERS` (outside the catalogue), a tuple of these, ``"pair"``, ``"triple"``,
``"stranger"``. Regimes: `hidden.noise.REGIMES`. ``table.noncentrality()`` is q. The same seed gives
the same table.
"""
