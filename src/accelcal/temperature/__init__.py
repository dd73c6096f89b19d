"""Temperature laws: bilinear about T0, from the tables' coefficients or from all readings.

`laws` wires them. The coefficients of the tables (`levels`) are fitted by generalised least
squares (`from_tables`), or all readings at once (`from_readings`) by the model of `product`. Where
temperatures move within the runs, `felt_deviations` brings the readings to the mean of their run
before that.

R records of one plan are worked on together, and these names mean the same throughout:

``tables``
    the tables of any of them, which are alike in all but the numbers;
``estimate``
    the coefficients of all tables in all records, with noise, head error and shifts;
``temperatures``, ``uncertain``
    the temperatures of all records; standard uncertainty of the level of each table, shape
    (R, tables) [degC], and its degrees of freedom;
``chosen``
    places of the tables of one mounting that mean the same by K0, K1 and M;
``rise``
    T - T0 [degC];
``sides``
    the sides of T0 that were measured, of all records alike, see
    ``accelcal.reference.measured_sides``.
"""
