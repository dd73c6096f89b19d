"""Files in and out: tables of readings and calibration documents."""
