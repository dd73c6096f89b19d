"""A calibration as a digital calibration certificate (DCC) of the PTB."""
