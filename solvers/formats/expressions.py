"""The grammar that the text formats share: polynomials as sums of products, straight onto a tape.

    sum     = [sign] product { ("+" | "-") [sign] product }
    product = power { ("*" power) | ("/" constant) }
    power   = atom [ ("^" | "**") exponent ]
    atom    = number | name | "(" sum ")"

Nothing is evaluated but numbers, and these exactly. A file from a stranger can be long, deep or absurd; each limit
below stops one kind of absurdity with a sentence.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from fractions import Fraction

from solvers.from_sympy import InvalidSystem
from solvers.graph import Builder, Node
from solvers.tape import Exact, exact, rounded

#: Parentheses deeper than this are refused; the parser recurses once for each.
DEEPEST = 100
#: Exponents and degrees above this are refused: no tracker follows so many paths.
LARGEST_EXPONENT = 10_000
#: Decimal digits of a number, and size of its power of ten.
LONGEST_NUMBER = 2000
LARGEST_POWER_OF_TEN = 400
#: Bits of a constant that a power of constants may have.
LARGEST_CONSTANT_BITS = 20_000

#: Editors put it before a text to say that it is UTF-8; readers drop it.
BYTE_ORDER_MARK = "\ufeff"

#: A value is either an exact constant (pair of fractions) or a node of the tape.
Value = Exact | Node

_ZERO = exact(0)
_ONE = exact(1)

TOKEN = re.compile(
    r"""
      (?P<space>[ \t\r\n]+)
    | (?P<number>(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)
    | (?P<name>[A-Za-z_][A-Za-z_0-9]*)
    | (?P<power>\*\*|\^)
    | (?P<sign>[+-])
    | (?P<symbol>[*/();,=:{}\[\]])
    """,
    re.VERBOSE | re.ASCII,  # digits are 0 to 9, as in the programs that these files are for
)


class FormatError(InvalidSystem):
    """A text that is not a system in the format; the message begins with line and column.

    Attributes
    ----------
    line, column : int
        Counted from one.
    """

    def __init__(self, text: str, offset: int, message: str) -> None:
        before = text[:offset]
        self.line = before.count("\n") + 1
        self.column = offset - (before.rfind("\n") + 1) + 1
        super().__init__(f"line {self.line}, column {self.column}: {message}")


class Reader:
    """Tokens of a text, and expressions read from them onto a tape.

    Parameters
    ----------
    text : str
    start : int
        Where to begin.
    comment : str, optional
        A character that begins a comment to the end of the line.
    """

    def __init__(self, text: str, start: int = 0, comment: str | None = None) -> None:
        self.text = text
        self.kinds: list[str] = []
        self.words: list[str] = []
        self.offsets: list[int] = []
        self.at = 0
        self.builder: Builder | None = None
        self.names: Mapping[str, Value] = {}
        self._numbers: dict[str, Exact] = {}
        self._powers: dict[tuple[Node, int], Node] = {}
        self._scan(start, comment)

    def _scan(self, start: int, comment: str | None) -> None:
        text, position, end = self.text, start, len(self.text)
        match = TOKEN.match
        while position < end:
            found = match(text, position)
            if found is None:
                if comment is not None and text[position] == comment:
                    line_end = text.find("\n", position)
                    position = end if line_end < 0 else line_end
                    continue
                # Kept as a token: what lies behind the system may be any text.
                self.kinds.append("strange")
                self.words.append(text[position])
                self.offsets.append(position)
                position += 1
                continue
            kind = found.lastgroup
            if kind != "space":
                self.kinds.append(kind or "")
                self.words.append(found.group())
                self.offsets.append(position)
            position = found.end()
        self.kinds.append("end")
        self.words.append("")
        self.offsets.append(end)

    # -- tokens -----------------------------------------------------------------------------------------------
    @property
    def kind(self) -> str:
        """The kind of the next token: number, name, power, sign, symbol, strange or end."""
        return self.kinds[self.at]

    @property
    def word(self) -> str:
        """The text of the next token."""
        return self.words[self.at]

    def is_whole(self) -> bool:
        """Whether the next token is a whole number. (str.isdigit alone holds for ², too, which int refuses.)"""
        return self.kind == "number" and self.word.isdigit()

    def error(self, message: str, at: int | None = None) -> FormatError:
        """A FormatError at the next token, or at token number `at`."""
        return FormatError(self.text, self.offsets[self.at if at is None else at], message)

    def expect(self, word: str, where: str) -> None:
        """Take the token `word`, or say that it is missing."""
        if self.word != word:
            raise self.error(f"{word!r} is missing {where}, {self.found()}")
        self.at += 1

    def found(self) -> str:
        """'found …' for messages."""
        return "the text ends here" if self.kind == "end" else f"found {self.word[:40]!r}"

    # -- grammar ----------------------------------------------------------------------------------------------
    def sum(self, depth: int = 0) -> Value:
        """Read a sum of products."""
        if depth > DEEPEST:
            raise self.error(f"parentheses are nested more than {DEEPEST} deep")
        builder = self.builder
        assert builder is not None
        constant = _ZERO
        summands: list[tuple[Exact, int]] = []
        total: Node | None = None
        negative = self._signs()
        while True:
            place = self.at
            value = self._product(depth)
            if isinstance(value, tuple):
                summands.append((value, place))
                constant = _minus(constant, value) if negative else _plus(constant, value)
            elif total is None:
                total = builder.negate(value) if negative else value
            else:
                total = builder.sub(total, value) if negative else builder.add(total, value)
            if self.kinds[self.at] != "sign":
                break
            negative = self._signs()
        if total is None:
            return constant
        if constant == _ZERO:
            return total
        return builder.add(total, self._constant(constant, summands))

    def _constant(self, value: Exact, parts: list[tuple[Exact, int]]) -> Node:
        """A constant as a node, or an error at the largest of the parts that made it."""
        assert self.builder is not None
        try:
            rounded(value)
        except InvalidSystem as error:
            raise self.error(str(error), max(parts, key=lambda part: max(map(abs, part[0])))[1]) from None
        return self.builder.constant(value)

    def _signs(self) -> bool:
        negative = False
        while self.kinds[self.at] == "sign":
            negative ^= self.words[self.at] == "-"
            self.at += 1
        return negative

    def _product(self, depth: int) -> Value:
        builder = self.builder
        assert builder is not None
        constant = _ONE
        place = self.at
        total: Node | None = None
        while True:
            value = self._power(depth)
            if isinstance(value, tuple):
                constant = value if constant is _ONE else _times(constant, value)
            else:
                total = value if total is None else builder.multiply(total, value)
            while self.words[self.at] == "/":
                constant = self._divide(constant, depth)
            if self.words[self.at] != "*":
                break
            self.at += 1
        if total is None:
            return constant
        if constant is _ONE:
            return total
        return builder.multiply(self._constant(constant, [(constant, place)]), total)

    def _divide(self, constant: Exact, depth: int) -> Exact:
        place = self.at
        self.at += 1
        divisor = self._power(depth)
        if not isinstance(divisor, tuple):
            raise self.error("only a number may stand behind '/': multiply the equation by its denominator", place)
        norm = divisor[0] ** 2 + divisor[1] ** 2
        if norm == 0:
            raise self.error("division by zero", place)
        return _times(constant, (divisor[0] / norm, -divisor[1] / norm))

    def _power(self, depth: int) -> Value:
        base = self._atom(depth)
        if self.kinds[self.at] != "power":
            return base
        self.at += 1
        exponent = self._exponent()
        if self.kinds[self.at] == "power":
            raise self.error("a power of a power needs parentheses to be read one way only")
        if isinstance(base, tuple):
            bits = max(part.numerator.bit_length() + part.denominator.bit_length() for part in base)
            if bits * exponent > LARGEST_CONSTANT_BITS:
                raise self.error("the power of this number is too large", self.at - 1)
            value = _ONE
            for _ in range(exponent):
                value = _times(value, base)
            return value
        if exponent == 0:
            return _ONE
        node = self._powers.get((base, exponent))
        if node is None:
            assert self.builder is not None
            node = self._powers[base, exponent] = self.builder.power(base, exponent)
        return node

    def _exponent(self) -> int:
        wrapped = self.word == "("
        self.at += wrapped
        word = self.word
        if word == "-":
            raise self.error("a negative exponent: multiply the equation by that power to make it polynomial")
        if not self.is_whole():
            raise self.error(f"an exponent must be a whole number, {self.found()}")
        if len(word) > 9 or int(word) > LARGEST_EXPONENT:
            raise self.error(f"the exponent {word[:20]} is larger than {LARGEST_EXPONENT}")
        self.at += 1
        if wrapped:
            self.expect(")", "behind the exponent")
        return int(word)

    def _atom(self, depth: int) -> Value:
        kind, word = self.kinds[self.at], self.words[self.at]
        if kind == "name":
            value = self.names.get(word)
            if value is None:
                raise self.unknown_name(word)
            self.at += 1
            self._no_juxtaposition(word)
            return value
        if kind == "number":
            number = self._numbers.get(word)
            if number is None:
                number = self._numbers[word] = (self._number(word), Fraction(0))
            self.at += 1
            self._no_juxtaposition(word)
            return number
        if word == "(":
            self.at += 1
            inside = self.sum(depth + 1)
            self.expect(")", "to close a parenthesis")
            self._no_juxtaposition(")")
            return inside
        before = self.words[self.at - 1] if self.at else ""
        behind = f" behind {before!r}" if before and before not in ";=" else ""
        raise self.error(f"a number, a name or a parenthesis is missing{behind}, {self.found()}")

    def _no_juxtaposition(self, word: str) -> None:
        kind, following = self.kinds[self.at], self.words[self.at]
        if kind in ("name", "number") or following == "(":
            raise self.error(f"an operator is missing between {word[:40]!r} and {following[:40]!r}")

    def _number(self, word: str) -> Fraction:
        mantissa, _, power = word.lower().partition("e")
        if len(mantissa) > LONGEST_NUMBER:
            raise self.error(f"a number of more than {LONGEST_NUMBER} digits")
        if power and (len(power) > 6 or abs(int(power)) > LARGEST_POWER_OF_TEN):
            raise self.error(
                f"the number {word[:40]} is out of range: its power of ten exceeds {LARGEST_POWER_OF_TEN}"
            )
        return Fraction(word)

    def unknown_name(self, word: str) -> FormatError:
        """The error for a name that means nothing here; formats may say more."""
        return self.error(f"the name {word[:40]!r} has not been declared")

    def node(self, value: Value, at: int) -> Node:
        """A value, which stands at token number `at`, as a node of the tape."""
        return self._constant(value, [(value, at)]) if isinstance(value, tuple) else value


def _plus(a: Exact, b: Exact) -> Exact:
    return a[0] + b[0], a[1] + b[1]


def _minus(a: Exact, b: Exact) -> Exact:
    return a[0] - b[0], a[1] - b[1]


def _times(a: Exact, b: Exact) -> Exact:
    if not a[1] and not b[1]:
        return a[0] * b[0], a[1]
    return a[0] * b[0] - a[1] * b[1], a[0] * b[1] + a[1] * b[0]
