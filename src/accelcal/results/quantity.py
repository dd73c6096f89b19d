"""The parts that results are made of: a quantity, a gate, an error source, residuals."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar, NoReturn

from accelcal.arguments.numbers import check_number_or_none
from accelcal.arguments.options import check_written
from accelcal.escapes import visible
from accelcal.plural import counted
from accelcal.results.documents.checked import (
    DamageError,
    Kind,
    freedom_or_none,
    mapping_of,
    size_or_none,
)
from accelcal.results.documents.fields import Document, StoredPart
from accelcal.units import headed_by_units

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["ErrorSource", "Gate", "Quantity", "Residuals"]


@dataclass(frozen=True, slots=True)
class Quantity(StoredPart):
    """A value with its uncertainty.

    Attributes
    ----------
    value : float or None
        The estimate; None where the data do not determine it.
    standard_uncertainty : float or None
        Standard uncertainty; None where nothing tells it.
    unit : str
        Unit of value and uncertainties; ``g`` is local g.
    expanded_uncertainty : float or None
        Half width of the 95 % interval.
    dof : float or None
        Effective degrees of freedom of the interval; None where infinite or unknown.

    Raises
    ------
    InputError
        If one is of another kind, no finite number, or a size below 0.

    Examples
    --------
    >>> import accelcal
    >>> bias = accelcal.Quantity(3.323e-3, 7.6e-6, "g", 1.5e-5)
    >>> bias.coverage_factor
    1.973684210526316
    >>> print(bias)
    3.323 +- 0.015 mg (95 %)
    >>> f"{bias:.6f}", bias.value
    ('0.003323 +- 0.000015 g (95 %)', 0.003323)
    """

    _KINDS: ClassVar[Mapping[str, Kind[Any]]] = {
        "standard_uncertainty": size_or_none,
        "expanded_uncertainty": size_or_none,
        "dof": freedom_or_none,
    }
    _MISSING: ClassVar[Mapping[str, Any]] = {"expanded_uncertainty": None, "dof": None}

    value: float | None
    standard_uncertainty: float | None
    unit: str
    expanded_uncertainty: float | None = None
    dof: float | None = None

    def __post_init__(self) -> None:
        check_written(unit=self.unit)
        check_number_or_none(value=self.value)
        check_number_or_none(
            0.0,
            standard_uncertainty=self.standard_uncertainty,
            expanded_uncertainty=self.expanded_uncertainty,
            dof=self.dof,
        )

    def __str__(self) -> str:
        from accelcal.report.numbers import told

        return told(self)

    def __repr__(self) -> str:
        return visible(f"<Quantity {self}>")

    def __format__(self, spec: str) -> str:
        """Write it as `str` does; by a format of numbers, value and half width in `unit`."""
        from accelcal.report.numbers import formatted

        return formatted(self, spec)

    def _is_no_number(self, *_: object) -> NoReturn:
        """Refuse, as the text may be in another unit than `value`."""
        raise TypeError(
            f"{self} is no bare number; take .value, in {self.unit}, or .standard_uncertainty"
        )

    __float__ = __int__ = __neg__ = __abs__ = __round__ = _is_no_number
    __add__ = __radd__ = __sub__ = __rsub__ = __mul__ = __rmul__ = _is_no_number
    __truediv__ = __rtruediv__ = __pow__ = __lt__ = __le__ = __gt__ = __ge__ = _is_no_number

    @property
    def coverage_factor(self) -> float | None:
        """Expanded over standard uncertainty."""
        if not self.standard_uncertainty or self.expanded_uncertainty is None:
            return None
        return self.expanded_uncertainty / self.standard_uncertainty

    @property
    def is_off_zero(self) -> bool:
        """Whether its 95 % interval leaves out 0; no where there is no value or no interval."""
        value, half = self.value, self.expanded_uncertainty
        return value is not None and half is not None and abs(value) > half


@dataclass(frozen=True, slots=True)
class Gate(StoredPart):
    """Outcome of one check.

    Attributes
    ----------
    name : str
        What was checked.
    verdict : str
        ``"pass"``, ``"warn"`` or ``"not assessed"``.
    finding : str
        What was found, or why it could not be assessed.
    """

    name: str
    verdict: str
    finding: str

    def __repr__(self) -> str:
        return f"<Gate {self.name}: {self.verdict}>"

    def _repr_html_(self) -> str:
        from accelcal.report.notebook import html_of

        return html_of([f"{self.verdict}: {self.name}: {self.finding}"])


@dataclass(frozen=True, slots=True)
class ErrorSource(StoredPart):
    """Size of one source of error and how it is known.

    Attributes
    ----------
    name : str
        ``"reading"``, ``"head"``, ``"launch"``, ``"launch_sf"`` or ``"temperature"``.
    value : float or None
        Standard deviation; None where unknown.
    unit : str
        Its unit.
    dof : float or None
        Degrees of freedom; None where infinite or unknown.
    source : str
        ``"declared"``, ``"estimated"``, ``"none"``, or where a reading's noise was taken from.
    """

    _KINDS: ClassVar[Mapping[str, Kind[Any]]] = {"value": size_or_none, "dof": freedom_or_none}
    _MISSING: ClassVar[Mapping[str, Any]] = {"dof": None}

    name: str
    value: float | None
    unit: str
    dof: float | None
    source: str


def sources_by_name(document: Document) -> tuple[ErrorSource, ...]:
    """Read sources of error that stand in a document under their names."""
    return tuple(mapping_of(ErrorSource.from_document)(document).values())


@dataclass(frozen=True, slots=True)
class Residuals(StoredPart):
    """Reading minus model, reading by reading.

    Attributes
    ----------
    angle_deg : tuple of float
        Head angle [deg].
    stroke : tuple of int
        Stroke.
    value : tuple of float
        Residual over K1 [g].

    Examples
    --------
    >>> residuals = Residuals(angle_deg=(0.0, 180.0), stroke=(1, 1), value=(2e-6, -3e-6))
    >>> residuals.to_frame().shape
    (2, 3)
    """

    angle_deg: tuple[float, ...] = ()
    stroke: tuple[int, ...] = ()
    value: tuple[float, ...] = ()

    def __repr__(self) -> str:
        return f"<Residuals of {counted(len(self.value), 'reading')}>"

    def _repr_html_(self) -> str:
        return headed_by_units(self.to_frame()).to_html(max_rows=20)

    def to_frame(self) -> pd.DataFrame:
        """Tabulate the residuals, a line each.

        Returns
        -------
        pandas.DataFrame
            The attributes; ``frame.attrs["units"]`` maps columns to units.
        """
        import pandas as pd

        frame = pd.DataFrame(self.to_document())
        frame.attrs["units"] = {"angle_deg": "deg", "value": "g"}
        return frame

    @classmethod
    def _read(cls, document: Document) -> Residuals:
        found = cls._of_fields(document)
        if not len(found.angle_deg) == len(found.stroke) == len(found.value):
            raise DamageError("lists of different lengths")
        return found
