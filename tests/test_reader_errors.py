"""A bad table gives one line: where, what is wrong, what would be right. Exact messages."""

from __future__ import annotations

import gzip
import io
import re
import zipfile
from pathlib import Path

import pytest

from accelcal.errors import AccelcalError, InputError, TableError
from accelcal.io.tables import read_table, read_tables
from accelcal.units import OUTPUT_UNITS

GUIDE = Path(__file__).parents[1] / "docs" / "csv-words.md"

H = "temperature,position,stroke,output\n"
OK = H + "20,1,1,1.3\n20,3,1,0.01\n20,5,1,-1.3\n"
NAMES = "the first row names the columns: temperature, position, stroke, output"
MARKS = "write numbers without thousands marks and with one decimal mark"
NUMBER = "write a number, or nothing where it is missing"
TURN = "J runs from 1 to 9 in a turn of 8 positions"
FROM_0 = "add 1 to each where they are counted from 0"
ANGLES = "head angles in degrees have the heading 'angle'"
UNITS = ", ".join(OUTPUT_UNITS)
FOREIGN = "export the table as CSV text and give that file"


def sheet_of(cells):
    """Of a workbook as much as is looked at before it is opened."""
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w") as archive:
        archive.writestr("xl/worksheets/sheet1.xml", cells)
    return file.getvalue()


ERRORS = {
    # the file
    "empty": ("", f"the file is empty; {NAMES}"),
    "blank": ("\n , \n", f"the file is empty; {NAMES}"),
    "header only": ("# serial: A\n", f"header lines, but no table; {NAMES}"),
    "positions alone": (
        "Pos. 1,Pos. 2,Pos. 3\n1.3,0.9,0.01\n",
        "1: no column for temperature among 'Pos. 1, Pos. 2, Pos. 3'; add a column temperature or"
        " a line '# temperature: 20'",
    ),
    "headings only": (H, "1: column headings but no readings; add a row for each reading"),
    "missing cells in place of headings": (
        "-;-;0,12\n",
        f"1: numbers where the column headings belong; {NAMES}",
    ),
    "no headings": ("20,1,1,1.3\n", f"1: numbers where the column headings belong; {NAMES}"),
    "prose": ("\nDear all,\n", f"2: no column headings in 'Dear all,'; {NAMES}"),
    "workbook": (
        b"PK\x03\x04" + b"\0" * 9,
        "no workbook that can be read (Cannot detect file format); save it again, export the table"
        " as CSV text, or unpack an archive of files",
    ),
    "far cell": (
        sheet_of('<c r="A1"/><c r="AD1048576"><v>1</v></c>'),
        "a sheet of 1048576 rows and 30 columns is too large; delete the cells far from the table,"
        " and save it again",
    ),
    "MATLAB": (
        b"MATLAB 5.0 MAT-file, written by N. N.",
        f"a MATLAB file, not a text table; {FOREIGN}",
    ),
    "gzip": (
        gzip.compress(OK.encode())[:-9],
        "the gzip compression is damaged or cut short; copy the file again",
    ),
    "zero bytes": (
        OK + "\0\0\0",
        "5: a zero byte: the file is damaged or not text; export the table again as text",
    ),
    "utf-16": (
        OK.encode("utf-16")[:-1],
        "the UTF-16 text is damaged; export the file again, best as UTF-8",
    ),
    # the columns
    "no temperature": (
        "position,stroke,output\n1,1,1\n",
        "1: no column for temperature among 'position, stroke, output';"
        " add a column temperature or a line '# temperature: 20'",
    ),
    "no position": (
        "temperature,stroke,output\n20,1,1\n",
        "1: no column for position or angle among 'temperature, stroke, output';"
        " add a column position or angle",
    ),
    "no stroke": (
        "temperature,position,output\n20,1,1\n",
        "1: no column for stroke among 'temperature, position, output';"
        " add a column stroke or a line '# stroke: 1'",
    ),
    "unknown headings below a form": (
        "Accelerometer;QX-12;;\nTemperature;25.1;degC;\nAngle;Run 1 [V];Run 2 [V]\n0;1.35;1.36\n",
        "3: no column headings in 'Angle;Run 1 [V];Run 2 [V]'; the first row names the columns:"
        " temperature, position, stroke, output",
    ),
    "runs that may be strokes": (
        "Temperatur;Stellung;Lauf;Messwert\n20;1;1;1\n",
        "1: no column for stroke among 'Temperatur, Stellung, Lauf, Messwert'; add a column stroke"
        " or a line '# stroke: 1', or call column 'Lauf' stroke if it counts them",
    ),
    "cycles that may be strokes": (
        "Temperatur;Stellung;Zyklus;Messwert\n20;1;1;1\n",
        "1: no column for stroke among 'Temperatur, Stellung, Zyklus, Messwert'; add a column"
        " stroke or a line '# stroke: 1', or call column 'Zyklus' stroke if it counts them",
    ),
    "no output": (
        "temperature,position,stroke\n20,1,1\n",
        "1: no column for output among 'temperature, position, stroke';"
        " add a column output, or Y1, Y2, ... for the strokes",
    ),
    "strokes by other names": (
        "T,J,Up [mA],Down [mA]\n20,1,1.3,1.3\n",
        "1: no column for output among 'T, J, Up [mA], Down [mA]';"
        " add a column output, or Y1, Y2, ... for the strokes, or a line"
        " '# serials: Up, Down' if these are accelerometers",
    ),
    "columns of one heading are not listed as serials": (
        "T,J,Up,Up\n20,1,1.3,1.3\n",
        "1: no column for output among 'T, J, Up, Up';"
        " add a column output, or Y1, Y2, ... for the strokes",
    ),
    "a serial listed twice": (
        "# serials: A7, A7\nT,J,k,A7,B2\n20,1,1,1.3,1.3\n",
        "2: serials has 'A7' twice; list each once, and give two columns of one heading different"
        " ones",
    ),
    "serial of no column": (
        "# serials: A7, C3\nT,J,k,A7,B2\n20,1,1,1.3,1.3\n",
        "2: no column 'C3', which serials has; list the serials as the headings have them",
    ),
    "column twice": (
        "T,Temp,position,stroke,output\n20,20,1,1,1\n",
        "1: columns 'T' and 'Temp' mean the same; keep one and rename the other",
    ),
    "stroke column twice": (
        "T,J,Y1,k1\n20,1,1,1\n",
        "1: columns 'Y1' and 'k1' mean the same; keep one and rename the other",
    ),
    "long and wide": (
        "T,J,k,Y1\n20,1,1,1\n",
        "1: columns 'k' and 'Y1' in one table;"
        " use stroke and output, or one output column for each stroke",
    ),
    "wide stroke 0": ("T,J,Y0,Y1\n20,1,1,1\n", "1: column 'Y0' is stroke 0; strokes count from 1"),
    "angles across, without their unit": (
        "T,k,0,45\n20,1,1,1\n",
        "1: column '0' is position 0; positions count from 1, and headings of head angles have a"
        " unit, as '0 deg'",
    ),
    "kelvin": (
        "temp [K],J,k,Y\n20,1,1,1\n20,3,1,0\n",
        "2: temp [K] '20' is no temperature of a test, from -200 to 250 degC;"
        " they are in K, by their heading or cells: correct the unit",
    ),
    "mrad": ("T,angle_mrad,k,Y\n20,1,1,1\n", "1: column 'angle_mrad' is in mrad; give it in deg"),
    "minutes of arc": (
        "T,angle [arcmin],k,Y\n20,1,1,1\n",
        "1: column 'angle [arcmin]' is in arcmin; give it in deg",
    ),
    "kelvin in cells": (
        "T [degC],J,k,Y\nNA,2,1,1\n233 K,1,1,1\n",
        "3: T [degC] '233 K' under a heading in degC; use one unit in a column",
    ),
    "gon in cells": (
        "T,angle,k,Y\n20,0 gon,1,1\n20,3 gon,1,2\n",
        "2: angle '0 gon' is in gon; give it in deg",
    ),
    "T0 without a unit beside fahrenheit": (
        "# T0: 20\n# temperature [F]: 68\nJ,k,Y\n1,1,1\n3,1,0\n",
        "1: reference_temperature is '20' without a unit, in a table in F;"
        " write its unit behind it, F or degC",
    ),
    "uncertainty without a unit beside fahrenheit": (
        "# temperature_uncertainty: 0.2\nT [°F],J,k,Y\n68,1,1,1\n68,3,1,0\n",
        "1: temperature_uncertainty is '0.2' without a unit, in a table in °F;"
        " write its unit behind it, °F or degC",
    ),
    "T0 in fahrenheit beside numbers without a unit": (
        "# T0: 68 degF\nT,J,k,Y\n68,1,1,1\n68,3,1,0\n",
        "1: reference_temperature is '68 degF', and the temperatures of the table have no unit;"
        " write theirs, as in T [degF] or T [degC], or give this one in degC",
    ),
    "headings alone, twice": (
        "T,J,k,Y\nT,J,k,Y\n",
        "1: column headings but no readings; add a row for each reading",
    ),
    # the rows
    "too many fields": (
        H + "20,1,1,1,3\n",
        "2: 5 fields under 4 column headings; give every column a heading,"
        " and with decimal commas separate the columns by semicolons",
    ),
    "too many fields, semicolon": (
        H.replace(",", ";") + "20;1;1;1;3\n",
        "2: 5 fields under 4 column headings; give every column a heading",
    ),
    "a row with too few cells between blanks": (
        "T J k Y x\n20 1 1 1.35\n",
        "2: 4 fields between blanks under 5 column headings; write NaN for a missing one, and"
        " headings without blanks",
    ),
    "positions across taken for strokes": (
        "# temperature: 20\nJ,1,2,3\n1,1.35,0.01,-1.34\n2,1.36,0.02,-1.33\n",
        "2: columns '1, 2, 3' differ as positions do, and rows as strokes; call the first column"
        " stroke, or these Y1, Y2, ... if they are strokes indeed",
    ),
    "positions in rows taken for strokes": (
        "# temperature: 20\nStroke,1,2\n1,1.35,1.36\n2,0.95,0.96\n3,0.01,0.02\n4,-0.9,-0.91\n",
        "2: columns '1, 2' differ as strokes do, and rows as positions; call the first column"
        " position, or these J1, J2, ... if they are positions indeed",
    ),
    "thousands mark of Germany": (
        H.replace(",", ";") + "20;1;1;601\n20;2;1;96.029\n20;3;1;-94.903\n20;4;1;-134.550\n",
        "3: output '96.029' is one of numbers without decimals or with three: '.' is no decimal"
        " mark; write numbers without thousands marks",
    ),
    "too few fields": (
        OK + "20,7,1\n",
        "5: 3 fields, but output is field 4; complete the row or delete it",
    ),
    "a line break in a cell": (
        H.replace("\n", ",note\n") + '20,1,1,1.3,"a\nb"\n20,2,1,1.2,c\n',
        "3: a cell has a line break; write it in one line",
    ),
    "a line break in the first cell": (
        "serial," + H + '"A\nB",20,1,1,1.3\n',
        "2: a cell has a line break; write it in one line",
    ),
    "header line with a unit inside": (
        OK + "# T0 [degC]: 25\n20,3,1,-0.01\n",
        "5: header line 'T0 [degC]: 25' inside the table;"
        " write it above the headings; one table a file, or a column serial",
    ),
    "header line inside": (
        OK + "# serial: B\n" + H + "60,1,1,1.3\n",
        "5: header line 'serial: B' inside the table;"
        " write it above the headings; one table a file, or a column serial",
    ),
    "headings again": (
        OK + OK,
        "5: the column headings stand here again;"
        " keep one table in a file, or tell several apart by a column serial or run",
    ),
    # the cells
    "text below a position": (
        "T,stroke,1,2,3,5\n20,1,1.3,0.9,zero,-1.3\n",
        f"2: column 3 'zero' is not a number; {NUMBER}",
    ),
    "text": (OK + "20,7,1,over\n", f"5: output 'over' is not a number; {NUMBER}"),
    "an angle in words": (
        "temperature,angle,stroke,output\n20,a half turn,1,1\n",
        "2: angle 'a half turn' is not a number; write head angles in degrees, as 22.5 or 22°30'",
    ),
    "an angle of 60 minutes": (
        "temperature,angle,stroke,output\n20,22°60',1,1\n",
        '2: angle "22°60\'" has 60 minutes or seconds or more; minutes and seconds are below 60',
    ),
    "a temperature in words": (
        OK + "warm,7,1,1.3\n",
        "5: temperature 'warm' is not a number; write a number, or 'unknown' where it is not known",
    ),
    "a position in words": (
        OK + "20,up,1,1.3\n",
        "5: position 'up' is not a number; write its number J; head angles have the heading"
        " 'angle'",
    ),
    "a stroke in words": (
        OK + "20,7,fwd,1.3\n",
        "5: stroke 'fwd' is not a number; write its number; words such as forward and back stand in"
        " a column direction",
    ),
    "underscore": (OK + "20,7,1,1_0\n", f"5: output '1_0' is not a number; {NUMBER}"),
    "infinite": (
        OK + "20,7,1,-inf\n",
        "5: output '-inf' is infinite or too large; write a finite number",
    ),
    "overflow": (
        OK + "20,7,1,1e999\n",
        "5: output '1e999' is infinite or too large; write a finite number",
    ),
    "thousands": (
        OK.replace(",", ";") + "20;7;1;1,234.5\n",
        f"5: output '1,234.5' does not fit the decimal mark '.'; {MARKS}",
    ),
    "thousands in quotes": (
        OK + '20,7,1,"1,234"\n',
        f"5: output '1,234' does not fit the decimal mark '.'; {MARKS}",
    ),
    "mixed decimal marks": (
        OK.replace(",", ";").replace(".", ",") + "20;7;1;0.5\n",
        f"5: output '0.5' does not fit the decimal mark ','; {MARKS}",
    ),
    "temperature empty": (
        OK + ",7,1,1\n",
        "5: temperature is empty; write it in every row, 'unknown' where it is not known",
    ),
    "cold": (
        OK + "-300,7,1,1\n",
        "5: temperature '-300' is no temperature of a test, from -200 to 250 degC;"
        " write temperatures in degC, or with their unit, as in T [K]",
    ),
    "hot": (
        "# temperature: 293\nJ,k,Y\n1,1,1\n",
        "1: temperature '293' is no temperature of a test, from -200 to 250 degC;"
        " write temperatures in degC, or with their unit, as in T [K]",
    ),
    "position 0": (
        OK + "20,0,1,1\n",
        f"5: position '0' is not a whole number from 1; {TURN}; {FROM_0}; {ANGLES}",
    ),
    "position 1.5": (
        OK + "20,1.5,1,1\n",
        f"5: position '1.5' is not a whole number from 1; {TURN}; {FROM_0}; {ANGLES}",
    ),
    "position 10": (
        OK + "20,10,1,1\n",
        f"5: position '10' is outside the turn; {TURN},"
        f" and a header line '# positions: N' declares another number; {ANGLES}",
    ),
    "position missing": (
        OK + "20,,1,1\n",
        "5: position is missing; write the position in every row",
    ),
    "angle missing": (
        "T,angle,k,Y\n20,0,1,1\n20,,1,2\n",
        "3: angle is missing; write the head angle in every row",
    ),
    "angle huge": (
        "T,angle,k,Y\n20,1e9,1,1\n",
        "2: angle '1e9' is no angle of a head; write head angles in degrees",
    ),
    "angles in radians": (
        "T,angle,k,Y\n20,0,1,1\n20,1.5708,1,0\n20,3.1416,1,-1\n",
        "3: angles of at most 3.1416 look like radians; write their unit in the"
        " heading, as angle [deg] or angle [rad]",
    ),
    "radians below degrees": (
        "T,angle [deg],k,Y\n20,0,1,1\n20,0.785,1,0.7\n20,1.571,1,0\n",
        "3: angles of at most 1.571 look like radians; write their unit in the"
        " heading, as angle [deg] or angle [rad]",
    ),
    "a calibration": (
        '{\n "schema": "accelcal/calibration/1",\n "method": "least-squares"}',
        "1: a calibration written by accelcal fit, not a table;"
        " give it to accelcal apply, budget or export, and here the table of readings",
    ),
    "another document": (
        '{"schema": "accelcal/stability/1"}',
        "1: a document 'accelcal/stability/1' of accelcal, not a table; give the table of readings",
    ),
    "json": ('[{"a": 1}]', "1: JSON, not a table; export the table as CSV text and give that file"),
    "angle against position": (
        "T,J,angle,k,Y\n20,1,360,1,1\n20,3,45,1,2\n",
        "3: angle '45' does not belong to its position, which it misses by more than 22.5 deg;"
        " correct one, or declare '# positions: N'",
    ),
    "stroke 0": (
        OK + "20,7,0,1\n",
        "5: stroke '0' is not a whole number from 1;"
        " strokes count from 1, odd ones go forward and even ones back",
    ),
    "stroke missing": (OK + "20,7,,1\n", "5: stroke is missing; write the stroke in every row"),
    "mounting": (
        "T,J,k,Y,mounting\n20,1,1,1,q\n",
        "2: mounting 'q' is unknown; it is one of o+, o-, p+, p-",
    ),
    "direction of no known name": (
        "T,J,k,direction,Y\n20,1,1,CW,1\n20,1,1,CCW,2\n",
        "2: direction 'CW' is neither forward nor back;"
        " write forward or back, or number the strokes",
    ),
    "direction against the stroke": (
        "T,J,k,direction,Y\n"
        + "".join(f"20,{j},1,fwd,{j}\n" for j in range(1, 9))
        + "20,9,1,back,1\n",
        "10: direction 'back' contradicts the number of the stroke;"
        " odd strokes go forward and even ones back, so correct one of both",
    ),
    "direction empty": (
        "T,J,k,direction,Y\n20,1,1,fwd,1\n20,2,1,,2\n",
        "3: direction is empty; write the direction in every row",
    ),
    "run empty": (
        "T,J,k,Y,run\n20,1,1,1,a\n20,2,1,1,\n",
        "3: run is empty; write the run in every row",
    ),
    "std": ("T,J,k,Y,std\n20,1,1,1,-1\n", "2: std '-1' is too small; it is 0 or more"),
    "count": ("T,J,k,Y,n\n20,1,1,1,0\n", "2: n '0' is too small; it is 1 or more"),
    "time missing": (
        "T,J,k,Y,time\n20,1,1,1,5\n20,2,1,2,\n",
        "3: time is missing; write the time of every reading, or leave the column out",
    ),
    "time in milliseconds since 1970": (
        "T,J,k,Y,time\n20,1,1,1,1717143600000\n20,2,1,2,1717143660000\n",
        "2: time '1717143600000' is no time of a record; write seconds, or name the unit of the"
        " time in its heading, such as time [ms]",
    ),
    "clock": (
        "T,J,k,Y,time\n20,1,1,1,25:01:05\n",
        "2: time '25:01:05' is not a number;"
        " write seconds, a clock time as 14:30:00, or both as 2024-05-31T14:30:00",
    ),
    "clock of no day": (
        "T,J,k,Y,time\n20,1,1,1,10:01:05\n20,2,1,2,24:00:00\n",
        "3: time '24:00:00' is no clock time;"
        " write it as in the first row, such as 14:30:00, in every row, or times in"
        " seconds",
    ),
    "clocks of 12 and 24 hours": (
        "T,J,k,Y,time\n20,1,1,1,10:01 AM\n20,2,1,2,10:02\n",
        "3: time '10:02' is no clock time;"
        " write it as in the first row, such as 14:30:00, in every row, or times in"
        " seconds",
    ),
    "clock missing": (
        "T,J,k,Y,time\n20,1,1,1,10:01\n20,2,1,2,\n",
        "3: time is no clock time;"
        " write it as in the first row, such as 14:30:00, in every row, or times in seconds",
    ),
    "day": (
        "T,J,k,Y,date,time\n20,1,1,1,2024-05-31,10:01\n20,2,1,2,5/31/2024,10:02\n",
        "3: date '5/31/2024' is not a date; write it as 2024-05-31 in every row",
    ),
    "day missing": (
        "T,J,k,Y,Datum,Uhrzeit\n20,1,1,1,2024-05-31,10:01\n20,2,1,2,,10:02\n",
        "3: Datum is not a date; write it as 2024-05-31 in every row",
    ),
    "date": (
        "T,J,k,Y,time\n20,1,1,1,2024-05-31 10:00\n20,2,1,2,10:01\n",
        "3: time '10:01' is not a date and time; write it as 2024-05-31T14:30:00",
    ),
    # the readings together
    "twice": (
        OK + "20,1,1,1.4\n",
        "5: position 1, stroke 1 at 20 degC has output 1.4, but 1.3 in line 2;"
        " delete one, number the strokes, or tell the runs apart by a column run",
    ),
    "return as the start": (  # a head that counts from 0 to 359 deg
        "T,angle,k,Y\n20,0,1,1.5\n20,90,1,0\n20,180,1,-1.5\n20,270,1,0.1\n20,0,1,1.25\n",
        "6: angle 0, stroke 1 at 20 degC has output 1.25, but 1.5 in line 2;"
        " write the return to it as 360",
    ),
    "too near for a return": (
        "T,angle,k,Y\n20,0,1,1.5\n20,90,1,0\n20,180,1,-1.5\n20,0,1,1.25\n",
        "5: angle 0, stroke 1 at 20 degC has output 1.25, but 1.5 in line 2;"
        " delete one, number the strokes, or tell the runs apart by a column run",
    ),
    "again below another stroke": (
        "T,angle,k,Y\n20,0,1,1.5\n20,90,1,0\n20,0,2,1.5\n20,90,2,0\n20,180,2,-1\n20,0,1,1.25\n",
        "7: angle 0, stroke 1 at 20 degC has output 1.25, but 1.5 in line 2;"
        " delete one, number the strokes, or tell the runs apart by a column run",
    ),
    "a label in two ways": (
        "T,J,k,Y,run\n20,1,1,1.5,1\n20,5,1,-1.5,1.0\n",
        "3: run '1.0' is '1' in another row; write each run in one way",
    ),
    "a label without its zeros": (
        "T,J,k,Y,serial\n20,1,1,1.5,7\n20,5,1,-1.5,007\n",
        "3: serial '007' is '7' in another row; write each serial in one way",
    ),
    "samples": (
        "T,J,k,Y\n20,1,1,1.5\n20,1,1,1.25\n20,3,1,0\n20,3,1,0.25\n",
        "3: position 1, stroke 1 at 20 degC has output 1.25, but 1.5 in line 2;"
        " average the samples of a reading: write their mean, with columns std and n",
    ),
    "twice in a run": (
        "T,angle,k,Y,run\n20,30,1,1.5,a\n21,30,1,1.25,a\n",
        "3: angle 30, stroke 1 at 21 degC has output 1.25, but 1.5 in line 2;"
        " delete one, or give each visit to a temperature its own label in the column run",
    ),
    "all equal": (
        H + "20,1,1,1.5\n20,2,1,1.5\n",
        "2: all 2 outputs are 1.5;"
        " check the voltmeter and the output column; the output changes with the angle",
    ),
    "all missing": (
        H + "20,1,1,\n20,2,1,NaN\n",
        "2: all 2 outputs are missing; write at least one",
    ),
    "serial without readings": (
        "serial,T,J,k,Y\nA,20,1,1,1\nB,20,1,1,\n",
        "3: serial 'B' has no output that is not missing; write its outputs or delete its rows",
    ),
    "serial against column": (
        "# serial: A\nserial,T,J,k,Y\nB,20,1,1,1\n",
        "2: serial 'B' in the table, but 'A' declared; leave the column or the declaration out",
    ),
    "no levels": (
        H + "20,1,1,1\n21,2,1,2\n22,3,1,3\n23,4,1,4\n",
        "5: temperature 23 joins the level that starts at 20 degC, more than 2 degC away;"
        " tell the runs apart by a column run",
    ),
    "run not declared": (
        "# runs: a,b\nT,J,k,Y,run\n20,1,1,1,c\n",
        "3: run 'c' is not among the declared runs; add it to the line '# runs: ...'",
    ),
    "units": (
        "# unit: V\ntemperature,position,stroke,output_mA\n20,1,1,1\n",
        "2: units 'V' and 'mA' in one table; give all outputs and their std in one unit",
    ),
    "units of the strokes": (
        "T,J,Y1 [mA],Y2 [V]\n20,1,1,1\n",
        "1: units 'mA' and 'V' in one table; give all outputs and their std in one unit",
    ),
    "units in a column": (
        "T,J,k,Y,unit\n20,1,1,1,V\n20,2,1,2,mV\n",
        "3: units 'V' and 'mV' in one table; give all outputs and their std in one unit",
    ),
    "units in the cells": (
        H + "20,1,1,1 mA\n20,2,1,1 V\n",
        "3: output '1 V' after cells in mA; use one unit in a column",
    ),
    "cell unit against heading": (
        "T,J,k,Y [V]\n20,1,1,1 mA\n",
        "2: Y [V] '1 mA' under a heading in V; use one unit in a column",
    ),
    "unit unknown": (
        "# unit: mV/g\n" + OK,
        f"1: unit 'mV/g' is no output unit; it is one of {UNITS}",
    ),
    "unit of a heading": (
        H.replace("output", "output [furlong]") + "20,1,1,1\n",
        f"1: unit 'furlong' is no output unit; it is one of {UNITS}",
    ),
    "unit of a row": (
        "T,J,k,Y,unit\n20,1,1,1,V\n20,2,1,2,x\n",
        f"3: unit 'x' is no output unit; it is one of {UNITS}",
    ),
    "unit missing": ("# unit: -\n" + OK, f"1: unit '-' is no output unit; it is one of {UNITS}"),
    "mega": (
        OK.replace("output", "output_MA"),
        "1: unit 'MA' begins with mega; write mA if milli is meant",
    ),
    "mega in a cell": (
        H + "20,1,1,1 MV\n20,2,1,2 MV\n",
        "2: unit 'MV' begins with mega; write mV if milli is meant",
    ),
    "no nano": (
        "# unit: NA\n" + OK,
        "1: unit 'NA' begins with N, no prefix; write nA if nano is meant",
    ),
    "marker of a missing reading": (
        OK + "20,7,1,-9999\n",
        "5: output '-9999' looks like a marker of a missing reading; leave the cell empty",
    ),
    "overload of a voltmeter": (
        "temperature,position,stroke,output\n20,1,1,1.3\n20,5,1,-1.3\n20,3,1,9.90000000E+37\n",
        "4: output '9.90000000E+37' looks like a marker of a missing reading; leave the cell empty",
    ),
    "no number of a voltmeter": (
        "temperature,position,stroke,output\n20,1,1,1.3\n20,5,1,-1.3\n20,3,1,+9.91E+37\n",
        "4: output '+9.91E+37' looks like a marker of a missing reading; leave the cell empty",
    ),
    "marker in a wide table": (
        "temperature,position,Y1,Y2\n20,1,1.3,1.3\n20,5,-1.3,-999.99\n",
        "3: Y2 '-999.99' looks like a marker of a missing reading; leave the cell empty",
    ),
    "date of two ways": (
        "T,J,k,Y,time\n20,1,1,1.3,05/06/2024 14:30\n20,5,1,-1.3,05/06/2024 14:31\n",
        "2: time '05/06/2024 14:30' is no date that can be read; write it as 2024-05-31T14:30:00,"
        " where nobody takes the day for the month",
    ),
    "positions in g": (
        "T,position,k,Y\n20,+1g,1,1.3\n20,-1g,1,-1.3\n",
        "2: position '+1g' is no number of a position; write a column angle: +1 g is 0 deg, -1 g is"
        " 180, and 0 g is 90 or 270",
    ),
    "split numbers": (
        "T,J,k,Y,std\n20,1,1,1,304998\n20,5,1,-1,295059\n",
        "1: '1,304998' below two headings looks like a number with a decimal comma; separate the"
        " columns by semicolons",
    ),
    "rows that end early": (
        "T,J,,Y1,Y2\n20,1,1.3,1.3\n20,5,-1.3,-1.3\n",
        "1: no row has more than 4 fields, but 5 have headings; leave empty fields where some"
        " are missing, or delete the heading Y2",
    ),
    "readings above the headings": (
        f"20,1,1,1.3\n{H}20,5,1,-1.3\n",
        "1: a row of numbers above the column headings; write it below them",
    ),
    "row numbers": (
        H + "".join(f"20,{j % 8 + 1},{j // 8 + 1},{j + 1}\n" for j in range(16)),
        "2: output '1' and those below count the rows; call another column output",
    ),
    "text alone": (
        "# temperature: 20\nposition,Y1,Y2\n1,1.3,1.3\n5,-1.3,-1.3\n60 °C\n3,0.01,0.01\n",
        "5: position '60 °C' is not a number, and its row has no output; repeat the headings below"
        " what is of another temperature or run",
    ),
    # the header lines
    "gravity below zero": (
        "# g: -9\n" + OK,
        "1: local gravity -9.0 m/s^2 is found nowhere on Earth;"
        " it lies between 9.76 and 9.84, in m/s^2",
    ),
    "fixture angle": (
        "# delta0: 10\n" + OK,
        "1: fixture angle 10 rad is above pi/4; give it in rad, 10 deg are 0.174533 rad",
    ),
    "fixture angle in another unit": (
        "# delta0: 2 mA\n" + OK,
        "1: delta0 is given in 'mA'; give it in rad, mrad, urad, nrad, deg, arcmin, arcsec",
    ),
    "fixture angle as text": (
        "# serial: A\n# delta0: small\n" + OK,
        "2: delta0 is 'small'; give it as a number",
    ),
    "gravity": (
        "# g: 981\n" + OK,
        "1: local gravity 981.0 m/s^2 is found nowhere on Earth;"
        " it lies between 9.76 and 9.84, in m/s^2",
    ),
    "header text": ("# g: local\n" + OK, "1: local_gravity is 'local'; give it as a number"),
    "header infinite": (
        "# T0: 1e999\n" + OK,
        "1: reference_temperature is inf; it is a finite number",
    ),
    "T0": (
        "# T0: 293\n" + OK,
        "1: reference_temperature is 293; it is a temperature of the test in degC",
    ),
    "header large": (
        "# temperature_uncertainty: 1e9\n" + OK,
        "1: temperature_uncertainty is 1000000000.0; it is below 100 degC",
    ),
    "header without its unit": (
        "# head_uncertainty: 2\n" + OK,
        "1: head_uncertainty is 2.0; it is below 0.1 rad; a unit may follow, as 2 arcsec",
    ),
    "header negative": (
        "# resolution: -1\n" + OK,
        "1: resolution is -1.0; it is a finite number, zero or more",
    ),
    "header unit": (
        "# head_uncertainty (gon): 2\n" + OK,
        "1: head_uncertainty is given in 'gon'; give it in rad, mrad, urad, nrad, deg, arcmin,"
        " arcsec, g, mg, ug, ng",
    ),
    "header with a factor": (
        "# head_uncertainty (95 %, k=2): 4 arcsec\n" + OK,
        "1: head_uncertainty is '4 arcsec 95 %, k=2', with a factor; give the standard uncertainty"
        " alone, that of k = 1",
    ),
    "header mega": (
        "# launch_uncertainty: 20 MG\n" + OK,
        "1: launch_uncertainty is given in 'MG'; give it in g, mg, ug, ng",
    ),
    "header ratio": (
        "# launch_sf_uncertainty: 15 ug\n" + OK,
        "1: launch_sf_uncertainty is given in 'ug'; give it in 1, %, ppm, ppb",
    ),
    "header without gravity": (
        "# launch_uncertainty: 20 mGal\n" + OK,
        "1: launch_uncertainty is given in 'mGal' without the local gravity; give it in g, or"
        " declare '# g: ...', in m/s^2",
    ),
    "resolution unit": (
        "# unit: mA\n# resolution: 1 uV\n" + OK,
        "2: resolution is given in 'uV'; give it in mA",
    ),
    "resolution without the unit of outputs": (
        "# resolution: 1 uV\n" + OK,
        "1: resolution is given in 'uV'; give it in the output unit, or declare that unit, as in"
        " '# unit: mA'",
    ),
    "positions": (
        "# positions: many\n" + OK,
        "1: positions is 'many'; it is the number of positions in a full turn, such as 8",
    ),
    "unit twice": (
        "# unit: V\n# unit: mA\n" + OK,
        "2: unit is 'mA', but 'V' in line 1; declare each key once",
    ),
    "key twice": (
        "# serial: A\n# S/N: B\n" + OK,
        "2: serial is 'B', but 'A' in line 1; declare each key once"
        "; that of an instrument is called by its name, as DMM S/N",
    ),
}


def message(content):
    data = content.encode() if isinstance(content, str) else content
    file = io.BytesIO(data)
    file.name = "table.csv"
    with pytest.raises(TableError) as caught:
        read_tables(file)
    return str(caught.value)


@pytest.mark.parametrize("name", ERRORS)
def test_message(name):
    content, expected = ERRORS[name]
    place = "table.csv:" if re.match(r"\d+: ", expected) else "table.csv: "
    assert message(content) == place + expected


MARKERS = ("999", "9999", "99999", "999999", "999.9", "999.99", "9999.9", "9999.99")


@pytest.mark.parametrize("marker", [*MARKERS, "9.9e37", "9.91e37", "9.9E36"])
def test_all_markers_are_known(marker):
    assert "looks like a marker of a missing reading" in message(f"{OK}20,7,1,-{marker}\n")


def test_no_file(tmp_path):
    path = tmp_path / "none.csv"
    remedy = "give the path of a table, or - for standard input"
    with pytest.raises(TableError, match=rf"none\.csv: no such file; {remedy}$"):
        read_table(path)
    with pytest.raises(TableError, match=r"is a folder; give the path of one table$"):
        read_table(tmp_path)


@pytest.mark.parametrize("rows", [1, 10_000])
def test_text_in_place_of_a_path_is_not_shown_whole(rows):
    with pytest.raises(TableError) as caught:
        read_table("position,Y1\n" + "1,1.30\n" * rows)
    remedy = "give the path of a table, or its text as io.StringIO(text)"
    assert str(caught.value) == f"<text>: text in place of a path; {remedy}"


def test_text_file_in_the_wrong_encoding(tmp_path):
    path = tmp_path / "latin.csv"
    path.write_bytes(b"# operator: M\xfcller\n" + OK.encode())
    with path.open(encoding="utf-8") as file, pytest.raises(TableError, match="cannot be decoded"):
        read_table(file)


@pytest.mark.parametrize(
    "overrides", [{"local_gravity": 98.1}, {"positions": 0}, {"head_uncertainty": -1.0}]
)
def test_bad_overrides(overrides):
    with pytest.raises(InputError) as caught:
        read_table(io.StringIO(OK), overrides=overrides)
    assert not isinstance(caught.value, TableError)


def test_errors_are_of_the_family():
    with pytest.raises(AccelcalError):
        read_table(io.StringIO(""))


def guide_errors():
    """Messages of the guide as patterns; ``...`` stands for anything."""
    text = GUIDE.read_text(encoding="utf-8").split("## Errors")[1]
    rows = re.findall(r"^\| `(.+?)` \| (.+?) \|$", text, re.MULTILINE)
    return [
        re.compile(".+?".join(re.escape(piece) for piece in f"{problem}; {remedy}".split("...")))
        for problem, remedy in rows
    ]


def test_the_guide_tells_every_error():
    patterns = guide_errors()
    told = {name: re.sub(r"^\d+: ", "", expected) for name, (_, expected) in ERRORS.items()}
    untold = [text for text in told.values() if not any(p.fullmatch(text) for p in patterns)]
    unproved = [p.pattern for p in patterns if not any(p.fullmatch(text) for text in told.values())]
    assert (untold, unproved) == ([], [])


# -- thousands marks -------------------------------------------------------------------------------


def grouped(values, mark, unit="counts"):
    rows = (f"20;{j};1;{value:,d}" for j, value in enumerate(values, start=1))
    return f"T;J;k;output [{unit}]\n" + "\n".join(rows).replace(",", mark) + "\n"


@pytest.mark.parametrize("mark", [".", ","])
@pytest.mark.parametrize("unit", ["counts", "mA"])
def test_marks_of_thousands_are_not_those_of_decimals(mark, unit):
    """135.474 counts of a German program were read as 135 beside 601 as 601."""
    text = grouped([135474, 96029, 601, -94903, -134550], mark, unit)
    said = f":2: output [{unit}] '135{mark}474' is one of numbers without decimals or with three"
    with pytest.raises(TableError, match=re.escape(said)):
        read_table(io.StringIO(text))


@pytest.mark.parametrize("mark", [".", ","])
def test_whole_numbers_with_three_decimals_throughout_are_told(mark):
    text = grouped([335474, 296029, 200601, 105097, 65450], mark)
    *others, note = read_table(io.StringIO(text)).notes
    assert note.startswith("all outputs have three decimals, though counts are whole numbers")
    assert f"335{mark}474" in note
    told = list(read_table(io.StringIO(text.replace("counts", "kHz"))).notes)
    other = note.replace(
        "though counts are whole numbers", "and no other column has a decimal comma"
    )
    assert told == [*others, other] if mark == "," else others
    shown = text.replace("counts", "kHz").replace("20;", "20,1;")
    assert mark != "," or list(read_table(io.StringIO(shown)).notes) == others


@pytest.mark.parametrize(
    "outputs",
    [
        ("1.352", "0.954", "0", "-0.954", "-1"),  # thousands do not begin with 0
        ("1.35", "1.354", "1.358", "2", "1.353"),
        ("1.352", "2", "-1.354"),  # two numbers happen to have three decimals
        ("1352", "1.354", "1.358", "2", "1.353"),
    ],
)
def test_decimals_stay_decimals(outputs):
    rows = (f"20;{j};1;{output}" for j, output in enumerate(outputs, start=1))
    record = read_table(io.StringIO("T;J;k;output\n" + "\n".join(rows) + "\n"))
    assert record.output.tolist() == list(map(float, outputs))
