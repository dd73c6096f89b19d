"""``python -m accelcal`` is the command ``accelcal``."""

import sys

from accelcal.cli.main import main

if __name__ == "__main__":
    sys.exit(main())
