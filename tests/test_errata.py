"""Each erratum of (5) and (6), proved in exact arithmetic on the code of accelcal.printed.

The exact outputs come from (1) and a_i = g cos(th + d0), a_p = g sin(th + d0), written here with
sympy and without accelcal. Every coefficient counts as free, so "second order" is d0 squared.
"""

from __future__ import annotations

import doctest
import math
import re
from collections.abc import Callable
from functools import cache
from pathlib import Path

import pytest
import sympy as sp

from accelcal import printed
from accelcal.model import COEFFICIENTS
from accelcal.printed import ERRATA, Erratum

PAGE = Path(__file__).parents[1] / "docs" / "errata.md"
K0, K1, K2, K3, M, M_ip, d, g = sp.symbols("K0 K1 K2 K3 M M_ip delta0 g")
TRUTH = dict(zip(COEFFICIENTS, (K0, K1, K2, K3, M, M_ip), strict=True))
ROOT2 = sp.sqrt(2)
DIAGONALS = (2, 4, 6, 8)
PROOFS: dict[str, Callable[[], None]] = {}


@pytest.fixture(autouse=True)
def _exact_root(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(printed, "ROOT2", ROOT2)


def proves(where: str) -> Callable[[Callable[[], None]], Callable[[], None]]:
    def register(proof: Callable[[], None]) -> Callable[[], None]:
        assert where not in PROOFS, f"two proofs of {where}"
        PROOFS[where] = proof
        return proof

    return register


def exact_output(position: int) -> sp.Expr:
    angle = sp.pi * (position - 1) / 4 + d
    a_i, a_p = (sp.expand_trig(g * f(angle)) for f in (sp.cos, sp.sin))
    y = K0 + K1 * a_i + K2 * a_i**2 + K3 * a_i**3 + M * a_p + M_ip * a_i * a_p
    return sp.expand(y)


EXACT = {position: exact_output(position) for position in range(1, 10)}
MEANS = [EXACT[position] for position in range(1, 10)]


@cache
def to_order(expression: sp.Expr, order: int) -> sp.Expr:
    """Expand in d0 up to and including this order."""
    return sp.expand(sp.series(sp.expand(expression), d, 0, order + 1).removeO())


def equal(a: sp.Expr, b: sp.Expr) -> bool:
    """Tell whether a - b is zero for every d0, as a polynomial in its sine and cosine."""
    sine, cosine = sp.symbols("sine cosine")
    difference = sp.expand(sp.expand_trig((a - b) * g**3))
    polynomial = difference.subs({sp.sin(d): sine, sp.cos(d): cosine})
    return sp.expand(sp.rem(polynomial, sine**2 + cosine**2 - 1, sine)) == 0


@cache
def print_minus_exact(position: int) -> sp.Expr:
    line = printed.printed_outputs(TRUTH, d, g)[position - 1]
    return to_order(line - EXACT[position], 2)


def misprint(position: int, *symbols: sp.Symbol) -> sp.Expr:
    """Give the part of printed minus exact that holds these coefficients."""
    difference = print_minus_exact(position)
    return sp.expand(sum(difference.coeff(symbol) * symbol for symbol in symbols))


# Equation five, line by line


@proves("(5) Y1, Y5: M_ip")
def _() -> None:
    for position in (1, 5):
        assert misprint(position, M_ip) == -M_ip * g**2 * d


@proves("(5) Y2, Y4, Y6, Y8: M")
def _() -> None:
    for position, sign, slope in ((2, 1, 1), (4, 1, -1), (6, -1, 1), (8, -1, -1)):
        line = printed.printed_outputs({"M": M}, d, g)[position - 1]
        as_k1 = printed.printed_outputs({"K1": M}, d, g)[position - 1]
        assert line in (as_k1, -as_k1)  # "with the signs of K1"
        assert equal(line, sign * M * g / ROOT2 * (1 - slope * d))
        exact = sign * M * g / ROOT2 * (1 + slope * d - d**2 / 2)
        assert to_order(EXACT[position].coeff(M) * M, 2) == sp.expand(exact)
        assert to_order(misprint(position, M), 1) == sp.expand(-sign * slope * ROOT2 * M * g * d)


@proves("(5) Y2, Y4, Y6, Y8: M_ip")
def _() -> None:
    for position, sign, slope in ((2, 1, -1), (4, -1, 1), (6, 1, 1), (8, -1, -1)):
        as_printed = sign * M_ip * g / 2 * (1 + slope * ROOT2 * d)
        exact = sign * M_ip * g**2 / 2 * (1 - 2 * d**2)
        assert equal(printed.printed_outputs({"M_ip": M_ip}, d, g)[position - 1], as_printed)
        assert equal(to_order(EXACT[position].coeff(M_ip) * M_ip, 2), exact)
        false_output = to_order(misprint(position, M_ip).subs(g, 1), 1)
        assert false_output == sp.expand(sign * slope * M_ip * d / ROOT2)


@proves("(5) Y3, Y7: M_ip")
def _() -> None:
    for position, sign in ((3, -1), (7, 1)):
        as_printed = printed.printed_outputs({"M_ip": M_ip}, d, g)[position - 1]
        assert equal(as_printed, sign * M_ip * g * d)
        assert to_order(EXACT[position].coeff(M_ip), 2) == -(g**2) * d
    assert misprint(3, M_ip).subs(g, 1) == 0
    assert misprint(7, M_ip).subs(g, 1) == 2 * M_ip * d


@proves("(5) Y2, Y4, Y6, Y8: K1, K3")
def _() -> None:
    for position, sign, slope in ((2, 1, -1), (4, -1, 1), (6, -1, -1), (8, 1, 1)):
        k1 = sign * K1 * g / ROOT2 * (1 + slope * d - d**2 / 2)
        k3 = sign * K3 * g**3 / (2 * ROOT2) * (1 + 3 * slope * d + sp.Rational(3, 2) * d**2)
        exact = EXACT[position].coeff(K1) * K1 + EXACT[position].coeff(K3) * K3
        assert to_order(exact, 2) == sp.expand(k1 + k3)
        dropped = sign * (K1 * g / (2 * ROOT2) - 3 * K3 * g**3 / (4 * ROOT2)) * d**2
        assert misprint(position, K1, K3) == sp.expand(dropped)


def stated_difference(position: int) -> sp.Expr:
    """Printed minus exact to second order in d0, the sum of all errata of one line of (5)."""
    cut = (K1 * g - 3 * K3 * g**3 / 2) * d**2 / (2 * ROOT2)
    power = M_ip * (g - g**2) / 2
    linear = M_ip * g * d / ROOT2
    bend = M_ip * g**2 * d**2
    turned = ROOT2 * M * g * d
    bend_m = M * g * d**2 / (2 * ROOT2)
    return sp.expand(
        {
            1: -M_ip * g**2 * d,
            2: cut - turned + bend_m + power - linear + bend,
            3: M_ip * (g**2 - g) * d,
            4: -cut + turned + bend_m - power - linear - bend,
            5: -M_ip * g**2 * d,
            6: -cut + turned - bend_m + power + linear + bend,
            7: M_ip * (g**2 + g) * d,
            8: cut - turned - bend_m - power + linear - bend,
        }[position]
    )


@pytest.mark.parametrize("position", range(1, 9))
def test_line_of_5_differs_by_what_is_stated_and_nothing_else(position: int) -> None:
    assert print_minus_exact(position) == stated_difference(position)


@pytest.mark.parametrize("position", range(1, 9))
def test_what_is_right_in_a_line_of_5(position: int) -> None:
    assert misprint(position, K0, K2) == 0
    if position not in DIAGONALS:
        assert misprint(position, K1, K3, M) == 0
    else:
        assert to_order(misprint(position, K1, K3), 1) == 0


def test_the_printed_lines_close() -> None:
    lines = printed.printed_outputs(TRUTH, d, g)
    assert lines.shape == (9,)
    assert lines[8] == lines[0]
    assert equal(EXACT[9], EXACT[1])


# Equation six, fed with exact outputs


def from_exact(name: str) -> sp.Expr:
    return sp.expand(printed.printed_estimates(MEANS, d, g)[name])


@proves("(6) K1: sign")
def _() -> None:
    assert equal(from_exact("K1"), K3 * g**2 / 4 * sp.cos(3 * d))
    assert not from_exact("K1").subs(d, 0).has(K1)
    # no need to trust the exact outputs: the printed (5) in the printed (6) loses K1 as well
    own = printed.printed_estimates(printed.printed_outputs(TRUTH, d, g), d, g)["K1"]
    assert equal(sp.expand(own).subs(d, 0), K3 * g**2 / 4)


@proves("(6) K1: claim")
def _() -> None:
    found = printed.sign_corrected_estimates(MEANS, g)["K1"]
    exact = (K1 + 3 * K3 * g**2 / 4) * sp.cos(d) + M * sp.sin(d)
    assert equal(found, exact)
    claimed = K1 * (1 - d**2 / 2)
    missing = 3 * K3 * g**2 / 4 * (1 - d**2 / 2) + M * d
    assert to_order(found - claimed, 2) == sp.expand(missing)


@proves("(6) K3")
def _() -> None:
    stated = 2 * ROOT2 * K0 / g**3 + ROOT2 * (K2 + M_ip) / g - K3 / 2
    assert equal(from_exact("K3").subs(d, 0), stated)
    exact = ROOT2 / g**3 * (
        2 * K0 + K2 * g**2 * (1 - sp.sin(2 * d)) + M_ip * g**2 * sp.cos(2 * d)
    ) - K3 / 2 * sp.cos(3 * d)
    assert equal(from_exact("K3"), exact)
    y2, y6 = EXACT[2], EXACT[6]
    # Y2 - Y6 with the true K1 keeps the misalignment, and with the "+" K1 turns K3 as well
    with_true_k1 = ROOT2 / g**3 * (y2 - y6 - ROOT2 * g * K1)
    assert equal(with_true_k1.subs(d, 0), K3 + 2 * M / g**2)
    plus = printed.sign_corrected_estimates(MEANS, g)["K1"]
    with_plus = ROOT2 / g**3 * (y2 - y6 - ROOT2 * g * plus)
    assert equal(with_plus.subs(d, 0), 2 * M / g**2 - K3 / 2)
    assert to_order(with_plus, 1).coeff(d) == sp.expand(-2 * K1 / g**2 - 3 * K3)


@proves("(6) M")
def _() -> None:
    assert equal(from_exact("M"), K1 * sp.sin(d) + K3 * g**2 * sp.sin(d) ** 3 - M * sp.cos(d))
    assert to_order(from_exact("M"), 1) == K1 * d - M
    assert to_order(printed.corrected_estimates(MEANS, g)["M"], 1) == M - K1 * d
    # the printed (5) in the printed (6) turns M as well
    own = printed.printed_estimates(printed.printed_outputs(TRUTH, d, g), d, g)["M"]
    assert sp.expand(own).subs(d, 0) == -M


@proves("(6) M_ip")
def _() -> None:
    assert to_order(from_exact("M_ip"), 1) == M_ip * g
    assert to_order(from_exact("M_ip"), 2) == sp.expand(M_ip * g * (1 + 2 * d**2))
    corrected = (EXACT[2] + EXACT[6] - EXACT[4] - EXACT[8]) / (2 * g**2) + 2 * K2 * d
    assert to_order(corrected, 1) == M_ip


def test_the_printed_k0_and_k2_are_right_at_first_order_without_cross_coupling() -> None:
    k0 = K0 + g**2 * (K2 * sp.sin(d) ** 2 - M_ip * sp.sin(d) * sp.cos(d))
    assert equal(from_exact("K0"), k0)
    assert to_order(from_exact("K0"), 2) == sp.expand(K0 + K2 * g**2 * d**2 - M_ip * g**2 * d)
    assert equal(from_exact("K2"), K2 * sp.cos(2 * d) + M_ip * sp.sin(2 * d))
    assert to_order(from_exact("K2"), 1) == K2 + 2 * M_ip * d


def test_the_sign_corrected_set() -> None:
    found = printed.sign_corrected_estimates(MEANS, g)
    assert list(found) == ["K0", "K1", "K2", "M", "M_ip"]
    stated = {"K0": K0, "K1": K1 + 3 * K3 * g**2 / 4, "K2": K2, "M": M, "M_ip": M_ip}
    assert all(equal(found[name].subs(d, 0), stated[name]) for name in found)


@pytest.mark.parametrize(
    ("name", "returned"),
    [
        ("K0", K0 + g**2 * (K2 * sp.sin(d) ** 2 - M_ip * sp.sin(d) * sp.cos(d))),
        ("K1", K1 * sp.cos(d) + M * sp.sin(d) + 3 * K3 * g**2 * sp.sin(d) ** 2 * sp.cos(d)),
        ("K2", K2 * sp.cos(2 * d) + M_ip * sp.sin(2 * d)),
        ("K3", K3 * sp.cos(3 * d)),
        ("M", M * sp.cos(d) - K1 * sp.sin(d) - K3 * g**2 * sp.sin(d) ** 3),
        ("M_ip", M_ip * sp.cos(2 * d) - K2 * sp.sin(2 * d)),
    ],
)
def test_the_corrected_set_at_any_fixture_angle(name: str, returned: sp.Expr) -> None:
    found = printed.corrected_estimates(MEANS, g)
    assert tuple(found) == COEFFICIENTS
    assert equal(found[name], returned)
    assert sp.expand(found[name].subs(d, 0)) == TRUTH[name]


# The list, the proofs and the page


@pytest.mark.parametrize("erratum", ERRATA, ids=lambda e: e.where)
def test_erratum_is_proved(erratum: Erratum) -> None:
    assert erratum.where in PROOFS, f"no proof of {erratum.where}"
    PROOFS[erratum.where]()


def test_no_proof_without_an_erratum() -> None:
    places = [erratum.where for erratum in ERRATA]
    assert len(set(places)) == len(places)
    assert set(PROOFS) == set(places)


@pytest.fixture(scope="module")
def page() -> str:
    return PAGE.read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def sizes(page: str) -> dict[str, str]:
    """Run the code of the page, with the number for the root of 2, and take its sizes."""
    code = "\n".join(re.findall(r"```python\n(.*?)```", page, flags=re.DOTALL))
    example = doctest.DocTestParser().get_doctest(code, {}, "errata.md", str(PAGE), 0)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(printed, "ROOT2", math.sqrt(2))
        runner = doctest.DocTestRunner(optionflags=doctest.NORMALIZE_WHITESPACE)
        result = runner.run(example, clear_globs=False)
    assert result.attempted > 5
    assert result.failed == 0
    return example.globs["size"]


def test_the_page_sizes_every_erratum(sizes: dict[str, str]) -> None:
    assert set(sizes) == {erratum.where for erratum in ERRATA}


@pytest.mark.parametrize("erratum", ERRATA, ids=lambda e: e.where)
def test_erratum_is_on_the_page(erratum: Erratum, page: str, sizes: dict[str, str]) -> None:
    rows = [
        [cell.strip() for cell in line.strip("|").split("|")]
        for line in page.splitlines()
        if line.startswith(f"| {erratum.where} |")
    ]
    assert len(rows) == 2, "one row that tells the misprint, one that tells what follows"
    misprinted, follows = rows
    assert misprinted[1:3] == [erratum.printed, erratum.exact]
    assert len(misprinted[3]) > 20, "how to see it"
    assert misprinted[4] == sizes[erratum.where]
    assert follows[1:] == [erratum.consequence, erratum.remedy]


def test_the_page_names_the_three_closed_forms(page: str) -> None:
    for form in printed.CLOSED_FORMS:
        assert re.search(rf"^\| \*\*{form}\*\* .*`--method {form}`", page, flags=re.MULTILINE)
