"""Files of other programs: what they mean, what is wrong with them and where; and nothing breaks the reader."""

import re
import time
from fractions import Fraction

import numpy as np
import pytest
import sympy
from hypothesis import given, settings
from hypothesis import strategies as st

from benchmarks.zoo import ZOO
from solvers.formats import FormatError, read_bertini, read_phcpack, read_system, write_bertini, write_phcpack
from solvers.formats.numbers import decimal
from solvers.from_sympy import InvalidSystem
from solvers.supports import terms
from solvers.system import System

NOON = """ 3
x1*x2^2 + x1*x3^2 - 1.1*x1 + 1;
x2*x1^2 + x2*x3^2 - 1.1*x2 + 1;
x3*x1^2 + x3*x2^2 - 1.1*x3 + 1;

TITLE : anything ' may stand here; even 3 semicolons;;; and (
"""

CIRCLES = """% a comment with ; and =
CONFIG
TrackType: 0; odd: 1e-3;
END;
INPUT
variable_group x, y;
variable_group E;
function f, g, h;   % three of them
constant c;
c = 2.5 + I/2;
r = x^2 + y**2;
f = r - c;
g = (r + E)*x - 1.5e-1;
h = E - i0;
i0 = 3;
END;
"""
CIRCLES_IN_ORDER = CIRCLES.replace("h = E - i0;\ni0 = 3;", "i0 = 3;\nh = E - i0;")


def same(left, right):
    a, b = terms(left), terms(right)
    return all(np.array_equal(s, t) for s, t in zip(a.supports, b.supports)) and a.exact == b.exact


def test_phcpack_reads_as_published():
    assert same(read_phcpack(NOON), ZOO["noon3"].build())


def test_names_that_trap_others():
    system = read_phcpack("4 4\n x10*x1 - x1; E*x1 + E^2 - 2E0*E;\n i*x10 + I*I; e1 + 1e1;")
    assert system.unknowns == ("x10", "x1", "E", "e1")
    expected = {(0, 1, 1, 0): 1, (0, 0, 2, 0): 1, (0, 0, 1, 0): -2}
    expanded = terms(system)
    found = dict(zip(map(tuple, expanded.supports[1].tolist()), expanded.coefficients[1].tolist()))
    assert found == expected
    assert expanded.exact[2] == ((Fraction(0), Fraction(1)), (Fraction(-1), Fraction(0)))
    assert terms(read_phcpack("1\ne1 + 1e1;")).exact[0][1][0] == 10


def test_bertini_reads_declarations_constants_subfunctions_and_groups():
    system = read_bertini(CIRCLES_IN_ORDER)
    assert system.unknowns == ("x", "y", "E")
    assert system.groups == ((0, 1), (2,))
    x, y, E = sympy.symbols("x y E")
    r = x**2 + y**2
    half = sympy.Rational(1, 2)
    assert same(
        system, System([r - 5 * half - sympy.I / 2, (r + E) * x - sympy.Rational(3, 20), E - 3], [x, y, E])
    )


@pytest.mark.parametrize(
    "text, first",
    [
        ("2 2\n-x^2 - y + 5;\n x*y - 2;\n", "-x**2 - y + 5"),
        ("2 2\r\n+x^2 - y;\r\n x*y - 2;\r\n", "x**2 - y"),
        ("2 2\n\n - 3*x + y; x*y - 2;", "-3*x + y"),
        ("2\r-x + y;\rx*y - 2;", "-x + y"),
        ("2\n3*x + y;\n x - 2*y;", "3*x + y"),
        ("2\n2 + x - y;\n x - 2*y;", "2 + x - y"),
        ("2\n3/2*x + y; x*y - 2;", "3*x/2 + y"),
        ("2 2 x - y; x*y - 2;", "x - y"),
        ("2 x - y; x*y - 2;", "x - y"),
        ("2 (x - y)*3; x*y - 2;", "3*x - 3*y"),
    ],
)
def test_counts_end_with_their_line(text, first):
    found = read_phcpack(text)
    assert same(
        System.from_program(found.program, unknowns=found.unknowns),
        System([sympy.sympify(first), sympy.sympify(text.split(";")[1].strip())], sympy.symbols("x y")),
    )


@pytest.mark.parametrize("unknowns", [1, 2, 3])
def test_a_leading_sign_survives_phcpack(unknowns):
    names = sympy.symbols("x y z")[:unknowns]
    system = System([-sum(names) + 5, -2 * names[0] ** 2 + 1][: max(1, unknowns - 1)], names)
    assert same(read_phcpack(write_phcpack(system)), system)
    system = System([-sum(names) + 5, -2 * names[0] ** 2 + 1, names[-1] - 3, names[0] - 1], names)
    assert same(read_phcpack(write_phcpack(system)), system)


@pytest.mark.parametrize(
    "text, line, column, words",
    [
        ("2 3*x - y;\nx;", 1, 4, "new line, found '*'"),
        ("1 1 - x;", 1, 5, "new line, found '-'"),
        ("1 - x^2;", 1, 3, "new line, found '-'"),
        ("1 3;", 1, 4, "new line, found ';'"),
        ("1 2.5*x - 5;", 1, 3, "only the number of unknowns"),
        ("1\nx^²-1;", 2, 3, "whole number, found '²'"),
        ("1\nx^(2²)-1;", 2, 5, "')' is missing behind the exponent, found '²'"),
        ("1\n²*x;", 2, 1, "found '²'"),
        ("1\nx - ٣;", 2, 5, "found '٣'"),
        ("²\nx;", 1, 1, "number of equations, found '²'"),
        ("1 ²\nx;", 1, 3, "found '²'"),
        ("1 1\n*x;", 2, 1, "a number, a name or a parenthesis is missing"),
        ("2\nx - y + ;\nx;", 2, 9, "missing behind '+'"),
        ("2\nx - y;\n  x*2y;", 3, 6, "operator is missing between '2' and 'y'"),
        ("2\nx(y);\nx;", 2, 2, "operator is missing between 'x' and '('"),
        ("2\nx + y;\n", 3, 1, "ends after 1"),
        ("2\nx + y\n;x", 3, 3, "';' is missing"),
        ("x + y;", 1, 1, "number of equations"),
        ("", 1, 1, "number of equations"),
        ("2 3\nx + y; x;", 1, 1, "promises 3 unknowns"),
        ("1\nx^y;", 2, 3, "whole number"),
        ("1\nx^-2 - 1;", 2, 3, "negative exponent"),
        ("1\nx^2^3;", 2, 4, "parentheses"),
        ("1\n1/x;", 2, 2, "multiply the equation"),
        ("1\nx/(2-2);", 2, 2, "division by zero"),
        ("1\nx^99999;", 2, 3, "larger than"),
        ("1\n((x^5000)^5000);", 1, 1, "degree"),
        ("1\n" + "(" * 200 + "x" + ")" * 200 + ";", 2, 102, "nested"),
        ("1\n1e999999999*x;", 2, 1, "out of range"),
        ("1\nx - 1e400;", 2, 5, "the number -1e+400 is beyond the range of double precision"),
        ("1\nx^2 - 3 - 7/2e-310 + 1;", 2, 11, "the number -3.5e+310 is beyond"),
        ("2\nx - y;\n  x - 1e300*x*1e10;", 3, 7, "the number 1e+310 is beyond"),
        ("1\n(2 + i*1e309)*x - 1;", 2, 1, "the number 1e+309 is beyond"),
        ("1\n-1e309;", 2, 1, "the number -1e+309 is beyond"),
        ("1\nx + $;", 2, 5, "found '$'"),
        ("1\nx = 3;", 2, 3, "';' is missing"),
        ("1\n3;", 1, 1, "no unknowns"),
        ("1\n(x + 1;", 2, 7, "close a parenthesis"),
        ("1\n(9^999)^9999*x;", 2, 9, "too large"),
        ("999999999\nx;", 1, 1, "number of equations"),
    ],
)
def test_phcpack_errors_say_where(text, line, column, words):
    with pytest.raises(FormatError) as caught:
        read_phcpack(text)
    assert (caught.value.line, caught.value.column) == (line, column), caught.value
    assert words in str(caught.value)
    assert str(caught.value).startswith(f"line {line}, column {column}: ")


@pytest.mark.parametrize(
    "text, words",
    [
        ("variable_group x; function f; f = x^²;", "whole number, found '²'"),
        ("variable_group x; function f; f = ²;", "found '²'"),
        ("variable_group x; function f; f = x + y;", "'y' has not been declared"),
        ("variable_group x; function f; f = sin(x);", "sin is not polynomial"),
        ("variable_group x; function f; f = x + i;", "the imaginary unit is I"),
        ("variable_group x; function f, g; f = x;", "never defined"),
        ("variable_group x; f = x;", "no function"),
        ("function f; f = 1;", "no variable_group"),
        ("variable_group x, x; function f; f = x;", "declared twice"),
        ("variable_group x; function f; x = 3; f = x;", "is an unknown"),
        ("variable_group x; function f; f = x; f = 2;", "already has a value"),
        ("hom_variable_group x; function f; f = x;", "homogeneous"),
        ("pathvariable t; variable_group x; function f; f = x;", "homotopies"),
        ("variable_group I; function f; f = I;", "meaning of its own"),
        ("variable_group x; function f; f = x", "';' is missing"),
        ("variable_group x; function f; f x;", "'=' is missing"),
        ("variable_group ; function f; f = 1;", "a name is missing"),
        ("variable_group x; function f; c = 1e400; f = x - c;", "column 50: the number -1e+400 is beyond the range"),
        ("variable_group x; function f; f = 1e400;", "the number 1e+400 is beyond the range"),
        ("variable_group x; function f; 3 = x;", "must begin with a name"),
        ("", "no variable_group"),
    ],
)
def test_bertini_errors_are_sentences(text, words):
    with pytest.raises(FormatError, match=r"^line \d+, column \d+: ") as caught:
        read_bertini(text)
    assert words in str(caught.value)


@pytest.mark.parametrize("name", ["cyclic5", "noon3", "eco6", "cassou", "ipp2", "heart", "chandra6"])
def test_written_and_read_back(name):
    system = ZOO[name].build()
    assert same(read_bertini(write_bertini(system)), system)
    again = read_phcpack(write_phcpack(system))
    assert again.unknowns == tuple(map(str, system.unknowns))
    assert same(again, system)


def test_long_coefficients_are_rounded_to_a_double():
    system = ZOO["fourbar5"].build()
    again = read_phcpack(write_phcpack(system))
    for left, right in zip(terms(again).coefficients, terms(system).coefficients):
        assert np.allclose(left, right, rtol=1e-15, atol=0)


def test_order_of_unknowns_survives_phcpack():
    x, y, z = sympy.symbols("x y z")
    system = System([z - 1, y * z - x, x - 2], [x, y, z])
    text = write_phcpack(system)
    assert read_phcpack(text).unknowns == ("x", "y", "z")
    assert same(read_phcpack(text), system)


def test_parameters_are_written_as_numbers():
    x, p = sympy.symbols("x p")
    system = System([p * x**2 - 1 / p], [x], [p])
    for again in (
        read_phcpack(write_phcpack(system, [0.1 - 2j])),
        read_bertini(write_bertini(system, {"p": 0.1 - 2j})),
    ):
        assert np.allclose(terms(again).coefficients[0], terms(system, [0.1 - 2j]).coefficients[0], rtol=1e-15)


@pytest.mark.parametrize("name", ["i", "E", "I", "e"])
def test_names_that_would_be_misread_are_not_written(name):
    x = sympy.Symbol(name)
    with pytest.raises(InvalidSystem, match="rename"):
        write_phcpack(System([x**2 - 1], [x]))


@pytest.mark.parametrize("text", ["1\nx*1e400*1e-200 - 1e200;", "1\nx - (1e400 - 1e400) - 1e400/1e399;"])
def test_only_what_remains_of_a_number_must_be_a_double(text):
    assert read_phcpack(text).degrees == (1,)


@pytest.mark.parametrize(
    "power, words", [(400, "1e+400 is beyond"), (5000, "1e+5000 is beyond"), (-400, "1e-400 is too small")]
)
def test_numbers_that_are_no_doubles_are_not_written(power, words):
    x = sympy.Symbol("x")
    system = System([x - 1, sympy.Integer(10) ** power * x - 2], [x])
    with pytest.raises(InvalidSystem, match=re.escape(words)):
        write_bertini(system)
    with pytest.raises(InvalidSystem, match="equation 1, multiplied out: the number " + re.escape(words)):
        write_phcpack(system)


@given(st.fractions())
def test_decimals_are_exact_or_rounded_to_a_double(value):
    text = decimal(value)
    assert Fraction(text) == value or float(Fraction(text)) == float(value)


@pytest.mark.parametrize("count", [10_000, pytest.param(100_000, marks=pytest.mark.slow)])
def test_a_hundred_thousand_terms_in_seconds(count):
    rng = np.random.default_rng(0)
    exponents = rng.integers(0, 7, size=(count, 4)).tolist()
    rows = [" + ".join(f"{k % 97 + 1}.5*x1^{a}*x2^{b}*x3^{c}*x10^{d}" for k, (a, b, c, d) in enumerate(exponents))]
    text = "4\n" + ";\n".join([*rows, "x1 - 1", "x2 - 1", "x3 - x10"]) + ";\n"
    begin = time.process_time()
    system = read_phcpack(text)
    values = system.program.replay([1.0, 1.0, 1.0, 1.0])["F"]
    assert abs(values[0] - sum(k % 97 + 1.5 for k in range(count))) < 1e-3
    assert time.process_time() - begin < 20  # a few seconds, on any computer


def test_deep_sums_do_not_recurse():
    system = read_phcpack("1\n" + "x - " * 10_000 + "x;")
    assert system.degrees == (1,)


def test_files(tmp_path):
    path = tmp_path / "noon.txt"
    path.write_text(NOON)
    assert read_system(path).unknowns == ("x1", "x2", "x3")
    path.write_text("variable_group a; function f; f = a;")
    assert read_system(path).unknowns == ("a",)
    path.write_text("²\nx;", encoding="utf-8")
    with pytest.raises(FormatError, match="number of equations, found '²'"):
        read_system(path)
    path.write_bytes(b"2\n\xff\xfe")
    with pytest.raises(FormatError, match="not UTF-8"):
        read_system(path)


@pytest.mark.parametrize("line_end", ["\n", "\r\n"])
def test_a_byte_order_mark_is_dropped(tmp_path, line_end):
    path = tmp_path / "marked.txt"
    for text, read in ((NOON, read_phcpack), (NOON.lstrip(), read_phcpack), (CIRCLES_IN_ORDER, read_bertini)):
        text = text.replace("\n", line_end)
        assert same(read("\ufeff" + text), read(text))
        path.write_bytes(text.encode("utf-8-sig"))
        assert same(read_system(path), read(text))
    with pytest.raises(FormatError) as caught:
        read_phcpack("\ufeffx;")
    assert caught.value.column == 1
    path.write_bytes("INPUT variable_group x; function f; f = x;".encode("utf-8-sig"))
    assert read_system(path).unknowns == ("x",)


ALPHABET = "xyzEi01239.;+-*/^()= \n,Ie%&{}é²٣\\\"'_[]"
SEEDS = (
    NOON,
    CIRCLES,
    "2\nx**2 + (1.5 - 2*i)*y;\n x*y - 1/3;\n",
    "variable_group x; function f; f = (x+1)^3 - I;",
)


def mutated(rng):
    text = list(SEEDS[rng.integers(len(SEEDS))])
    for _ in range(rng.integers(1, 8)):
        at = int(rng.integers(0, len(text) + 1))
        kind = rng.integers(4)
        piece = "".join(ALPHABET[k] for k in rng.integers(0, len(ALPHABET), size=rng.integers(1, 6)))
        if kind == 0:
            text[at:at] = piece
        elif kind == 1:
            del text[at : at + int(rng.integers(1, 10))]
        elif kind == 2:
            text[at : at + 1] = piece
        else:
            source = int(rng.integers(0, len(text) + 1))
            text[at:at] = text[source : source + int(rng.integers(1, 40))]
    return "".join(text)


def survives(text):
    for read in (read_phcpack, read_bertini):
        try:
            system = read(text)
        except FormatError as error:
            message = str(error)
            assert message.startswith("line ") and len(message) < 2000
        else:
            assert isinstance(system, System)


def test_a_thousand_mutated_files_end_in_a_sentence():
    rng = np.random.default_rng(7)
    for _ in range(1000):
        survives(mutated(rng))


@pytest.mark.slow
def test_ten_thousand_mutated_files_end_in_a_sentence():
    rng = np.random.default_rng(8)
    for _ in range(10_000):
        survives(mutated(rng))


@settings(max_examples=300, deadline=None)
@given(st.text(alphabet=ALPHABET, max_size=200))
def test_any_text_ends_in_a_sentence(text):
    survives(text)
    survives("1\n" + text)
    survives("variable_group x, y; function f; f = " + text)
