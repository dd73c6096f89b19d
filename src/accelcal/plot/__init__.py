"""Results as pictures: functions of matplotlib axes, in one style, reached as ``result.plot``."""
