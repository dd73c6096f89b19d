"""Methods that name a missing effect, ours beside those that people would use.

Every method gets the record of a table and returns an `Answer`. The others get the columns of the
catalogue of accelcal, see `dictionary`; what is right is judged by the physics that made the table,
see `truth`.
"""

import os

for _library in ("OMP", "OPENBLAS", "MKL"):  # before numpy: one thread in each process
    os.environ.setdefault(f"{_library}_NUM_THREADS", "1")
