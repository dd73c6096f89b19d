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

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

from accelcal.version import __version__ as __version__

if TYPE_CHECKING:
    from accelcal.accelerometer import AL15 as AL15
    from accelcal.accelerometer import Accelerometer as Accelerometer
    from accelcal.accelerometer import BilinearLaw as BilinearLaw
    from accelcal.apparatus import Apparatus as Apparatus
    from accelcal.archive.batch import BatchCounts as BatchCounts
    from accelcal.archive.batch import BatchFrames as BatchFrames
    from accelcal.archive.batch import batch as batch
    from accelcal.archive.batch import write_batch as write_batch
    from accelcal.calibrate.fit import fit as fit
    from accelcal.compensate.apply import apply as apply
    from accelcal.compensate.at_temperature import coefficients_at as coefficients_at
    from accelcal.compensate.measured import MeasuredAcceleration as MeasuredAcceleration
    from accelcal.discovery.compare import compare as compare
    from accelcal.discovery.discover import discover as discover
    from accelcal.discovery.stand.discover import discover_stand as discover_stand
    from accelcal.discovery.twin import Twin as Twin
    from accelcal.discovery.twin import twin as twin
    from accelcal.effects.catalogue import catalogue as catalogue
    from accelcal.effects.catalogue import effect as effect
    from accelcal.effects.catalogue import register as register
    from accelcal.effects.catalogue import unregister as unregister
    from accelcal.effects.effect import Disturbance as Disturbance
    from accelcal.effects.effect import Effect as Effect
    from accelcal.effects.effect import Parameter as Parameter
    from accelcal.error_budget.budget import budget as budget
    from accelcal.error_budget.random_part import RandomPart as RandomPart
    from accelcal.error_budget.random_part import random_part as random_part
    from accelcal.errors import AccelcalError as AccelcalError
    from accelcal.errors import AccelcalWarning as AccelcalWarning
    from accelcal.errors import DesignError as DesignError
    from accelcal.errors import DocumentError as DocumentError
    from accelcal.errors import InputError as InputError
    from accelcal.errors import TableError as TableError
    from accelcal.estimate.self_calibration import calibrate_head as calibrate_head
    from accelcal.estimate.stacked_tables import TableEstimates as TableEstimates
    from accelcal.estimate.stacked_tables import estimate_tables as estimate_tables
    from accelcal.geometry import Acceleration as Acceleration
    from accelcal.geometry import accelerations as accelerations
    from accelcal.geometry import position_angles as position_angles
    from accelcal.io.arrays import read_arrays as read_arrays
    from accelcal.io.documents.discoveries import read_discovery as read_discovery
    from accelcal.io.head import read_head as read_head
    from accelcal.io.stability_record import read_stability as read_stability
    from accelcal.io.tables import read_table as read_table
    from accelcal.io.tables import read_tables as read_tables
    from accelcal.io.toml.effects import read_effects as read_effects
    from accelcal.io.toml.specification import read_specification as read_specification
    from accelcal.io.toml.stand import read_stand as read_stand
    from accelcal.io.triad import read_triad as read_triad
    from accelcal.io.writer import write_table as write_table
    from accelcal.model import design_matrix as design_matrix
    from accelcal.model import output as output
    from accelcal.planning.compare import design as design
    from accelcal.planning.optimum import optimal_design as optimal_design
    from accelcal.planning.pace import Pace as Pace
    from accelcal.recalibrations.history import history as history
    from accelcal.record import TumbleRecord as TumbleRecord
    from accelcal.results.calibration import Calibration as Calibration
    from accelcal.results.designs import DesignComparison as DesignComparison
    from accelcal.results.designs import TestDesign as TestDesign
    from accelcal.results.disagreement import Disagreement as Disagreement
    from accelcal.results.discovery import Discovery as Discovery
    from accelcal.results.error_budget import ErrorBudget as ErrorBudget
    from accelcal.results.head_calibration import HeadCalibration as HeadCalibration
    from accelcal.results.optimal_design import OptimalDesign as OptimalDesign
    from accelcal.results.quantity import Quantity as Quantity
    from accelcal.results.stability import Stability as Stability
    from accelcal.results.stand_budget import StandBudget as StandBudget
    from accelcal.results.stand_discovery import StandDiscovery as StandDiscovery
    from accelcal.results.triad import TriadCalibration as TriadCalibration
    from accelcal.results.unit_history import History as History
    from accelcal.results.verdict import Verdict as Verdict
    from accelcal.simulation import NoiseComponents as NoiseComponents
    from accelcal.simulation import TumblePlan as TumblePlan
    from accelcal.simulation import simulate as simulate
    from accelcal.specification import Limit as Limit
    from accelcal.specification import Specification as Specification
    from accelcal.stability.analysis import analyse as analyse
    from accelcal.stability.record import Launch as Launch
    from accelcal.stability.record import StabilityRecord as StabilityRecord
    from accelcal.stand_uncertainty.budget import stand_budget as stand_budget
    from accelcal.stand_uncertainty.distribution import Distribution as Distribution
    from accelcal.stand_uncertainty.distribution import distribution as distribution
    from accelcal.stand_uncertainty.stand import Stand as Stand
    from accelcal.stand_uncertainty.stand import StandComponent as StandComponent
    from accelcal.triad.calibrate import calibrate_triad as calibrate_triad
    from accelcal.triad.record import TriadRecord as TriadRecord
    from accelcal.verdict.judge import judge as judge

_PUBLIC = {
    "accelerometer": "Accelerometer AL15 BilinearLaw",
    "apparatus": "Apparatus",
    "archive.batch": "batch BatchCounts BatchFrames write_batch",
    "calibrate.fit": "fit",
    "compensate.apply": "apply",
    "compensate.at_temperature": "coefficients_at",
    "compensate.measured": "MeasuredAcceleration",
    "discovery.compare": "compare",
    "discovery.discover": "discover",
    "discovery.stand.discover": "discover_stand",
    "discovery.twin": "Twin twin",
    "effects.catalogue": "catalogue effect register unregister",
    "effects.effect": "Disturbance Effect Parameter",
    "error_budget.budget": "budget",
    "error_budget.random_part": "random_part RandomPart",
    "errors": "AccelcalError AccelcalWarning DesignError DocumentError InputError TableError",
    "estimate.self_calibration": "calibrate_head",
    "estimate.stacked_tables": "estimate_tables TableEstimates",
    "geometry": "Acceleration accelerations position_angles",
    "io.arrays": "read_arrays",
    "io.documents.discoveries": "read_discovery",
    "io.head": "read_head",
    "io.stability_record": "read_stability",
    "io.tables": "read_table read_tables",
    "io.toml.effects": "read_effects",
    "io.toml.specification": "read_specification",
    "io.toml.stand": "read_stand",
    "io.triad": "read_triad",
    "io.writer": "write_table",
    "model": "design_matrix output",
    "planning.compare": "design",
    "planning.optimum": "optimal_design",
    "planning.pace": "Pace",
    "recalibrations.history": "history",
    "record": "TumbleRecord",
    "results.calibration": "Calibration",
    "results.designs": "DesignComparison TestDesign",
    "results.disagreement": "Disagreement",
    "results.discovery": "Discovery",
    "results.error_budget": "ErrorBudget",
    "results.head_calibration": "HeadCalibration",
    "results.optimal_design": "OptimalDesign",
    "results.quantity": "Quantity",
    "results.stability": "Stability",
    "results.stand_budget": "StandBudget",
    "results.stand_discovery": "StandDiscovery",
    "results.triad": "TriadCalibration",
    "results.unit_history": "History",
    "results.verdict": "Verdict",
    "simulation": "NoiseComponents simulate TumblePlan",
    "specification": "Limit Specification",
    "stability.analysis": "analyse",
    "stability.record": "Launch StabilityRecord",
    "stand_uncertainty.budget": "stand_budget",
    "stand_uncertainty.distribution": "Distribution distribution",
    "stand_uncertainty.stand": "Stand StandComponent",
    "triad.calibrate": "calibrate_triad",
    "triad.record": "TriadRecord",
    "verdict.judge": "judge",
}
"""Module -> the public names that live in it."""

_HOME = {name: f"accelcal.{module}" for module, names in _PUBLIC.items() for name in names.split()}
__all__ = sorted(["__version__", *_HOME])


if not TYPE_CHECKING:  # a type checker reads the imports above, and finds misspelt names

    def __getattr__(name: str) -> object:
        """Import a public name when it is first used (PEP 562)."""
        if name not in _HOME:
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        value = getattr(import_module(_HOME[name]), name)
        globals()[name] = value
        return value

    def __dir__() -> list[str]:
        return sorted(__all__)
