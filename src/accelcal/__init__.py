"""Calibration of navigation pendulous accelerometers from tumble tests in the gravity field.

This page holds the conventions. Everything else in accelcal follows them.

Positions
    The shaft of the dividing head is horizontal. At head angle 0 the input axis points up and
    senses +1 g. Positions J count from 1; with n positions in a turn, J stands at the head angle
    (J - 1) * 360 / n degrees, and J = n + 1 is the return to J = 1. Positions are only a way of
    saying angles: any set of angles will do.
Strokes
    A stroke k is one pass through the positions. Strokes count from 1; odd ones run forward, even
    ones back.
Runs
    A run is one visit to a temperature. The same level met twice makes two runs. The readings of
    one run in one mounting are a table, the Y_JK of the paper.
Axes
    The input axis (IA), the pendulous axis (PA) and the output axis (OA) sense a_i, a_p and a_o.
    One cross axis lies along the shaft and gives the mounting its letter: ``o`` where OA lies
    there, ``p`` where PA does. ``o-`` and ``p-`` are turned by 180 deg about the input axis.
Acceleration
    In units of the **local** g, the gravity at the place of the test. No value of gravity is
    needed to calibrate. A given value [m/s^2] only converts the result.
Output
    In the unit of the table (mA, V, counts ...). Coefficients are in that unit per power of local
    g. Divided by the scale factor K1 they become the error model: k0 [g], k2 [g/g^2], k3 [g/g^3],
    delta [rad], delta_ip [g/g^2].
Other quantities
    Temperature in degC, time in s, head angle in deg, small angles (misalignment, head error) in
    rad. An uncertainty is a standard uncertainty (GUM) where no factor or probability is named.

The symbols of the paper stand in formulas; the longer names stand in the text and in the code.

========  ==================================================  ===================================
symbol    name                                                where
========  ==================================================  ===================================
Y         output, one reading                                 column ``output``
J         position                                            column ``position``
k         stroke                                              column ``stroke``
th        head angle                                          column ``angle``
T, T0     temperature, reference temperature                  column ``temperature``, key ``T0``
g         local gravity                                       key ``g``
d0        fixture angle between head zero and input axis      ``delta0``
K0        bias, in output units                               ``coefficients``
K1        scale factor                                        ``coefficients``
K2, K3    second- and third-order nonlinearity                ``coefficients``
M         misalignment seen in this mounting                  ``coefficients``
M_ip      cross-coupling seen in this mounting                ``coefficients``
k0        bias, in local g: K0/K1                             ``error_model``
k2, k3    nonlinearity, relative to the scale factor          ``error_model``
delta     misalignment, as an angle: M/K1                     ``error_model``
delta_ip  cross-coupling, relative to the scale factor        ``error_model``
========  ==================================================  ===================================

Files: tables of readings come in as CSV, long (a row per reading) or wide (a column per stroke),
with header lines ``# key: value``. Calibrations are JSON documents that name their schema.

Names of this package are imported when they are first used, so that ``import accelcal`` is quick.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
