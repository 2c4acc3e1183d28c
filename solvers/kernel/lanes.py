"""Vectors of lanes for compiled code: one register holds the same number of several paths.

Numba does not turn loops over lanes into vector instructions reliably, so a register is a type of its own here:
``<8 x double>`` with AVX-512, ``<4 x double>`` with AVX2, ``<2 x double>`` elsewhere. A :class:`Lanes` token
tells compiled code which; as it is part of the argument types, each width gets its own cache entry.
Arrays are seen as rows of `width` doubles.
"""

from __future__ import annotations

import operator
import os
from functools import cache
from typing import Any

import llvmlite.binding as llvm
from llvmlite import ir
from numba.core import types
from numba.core.cgutils import get_or_insert_function
from numba.core.typing.templates import AbstractTemplate, infer_global, signature
from numba.extending import (
    NativeValue,
    intrinsic,
    lower_builtin,
    models,
    register_model,
    typeof_impl,
    unbox,
)

from solvers.kernel.sources import source_digest

_DOUBLE, _LONG, _BIT = ir.DoubleType(), ir.IntType(64), ir.IntType(1)


class Lanes:
    """How many doubles a register holds, and whether the processor multiplies and adds in one instruction."""

    def __init__(self, width: int, fma: bool = True) -> None:
        if width not in (2, 4, 8):
            raise ValueError(f"{width} lanes; a register holds 2, 4 or 8 doubles")
        self.width, self.fma = width, fma

    def __repr__(self) -> str:
        return f"Lanes({self.width}, fma={self.fma})"

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Lanes) and (self.width, self.fma) == (other.width, other.fma)

    def __hash__(self) -> int:
        return hash((self.width, self.fma))


@cache
def native_lanes() -> Lanes:
    """The lanes of this processor; ``EVERYLINKAGE_LANES=4`` in the environment asks for a width."""
    features = processor_features()
    # NEON has a fused multiply-add wherever it has doubles.
    fma = features.get("fma", False) or features.get("neon", False) or features.get("fp-armv8", False)
    if "EVERYLINKAGE_LANES" in os.environ:
        return Lanes(int(os.environ["EVERYLINKAGE_LANES"]), fma)
    return Lanes(8 if features.get("avx512f") else 4 if features.get("avx2") else 2, fma)


@cache
def processor_features() -> dict[str, bool]:
    """Features of the processor that code is made for: the one numba is told to use, or the real one."""
    given = os.environ.get("NUMBA_CPU_NAME")
    if given:
        wide = given in ("skylake-avx512", "sapphirerapids", "znver4", "znver5", "x86-64-v4")
        plain = given in ("generic", "x86-64", "x86-64-v2", "nehalem", "sandybridge", "ivybridge")
        return {"avx512f": wide, "avx2": not plain, "fma": not plain}
    return dict(llvm.get_host_cpu_features())


# -- types ----------------------------------------------------------------------------------------------------
class LanesType(types.Type):
    """The type of the token; its name holds the state of the sources, so that no stale cache is ever used."""

    def __init__(self, width: int, fma: bool) -> None:
        self.width, self.fma = width, fma
        super().__init__(name=f"Lanes({width}, {fma}, {source_digest()})")


class Vector(types.Type):
    """One double for each lane."""

    def __init__(self, width: int, fma: bool) -> None:
        self.width, self.fma = width, fma
        super().__init__(name=f"Vector({width}, {fma})")


class Mask(types.Type):
    """One truth value for each lane."""

    def __init__(self, width: int) -> None:
        self.width = width
        super().__init__(name=f"Mask({width})")


@register_model(LanesType)
class _LanesModel(models.OpaqueModel):
    pass


@register_model(Vector)
class _VectorModel(models.PrimitiveModel):
    def __init__(self, manager, kind):
        super().__init__(manager, kind, ir.VectorType(_DOUBLE, kind.width))


@register_model(Mask)
class _MaskModel(models.PrimitiveModel):
    def __init__(self, manager, kind):
        super().__init__(manager, kind, ir.VectorType(_BIT, kind.width))


@typeof_impl.register(Lanes)
def _typeof_lanes(value, context):
    return LanesType(value.width, value.fma)


@unbox(LanesType)
def _unbox_lanes(kind, value, context):
    return NativeValue(context.context.get_dummy_value())


def instruction(generator: Any) -> Any:
    """A function for compiled code, given by a function that types and writes its LLVM instructions."""
    return intrinsic(generator)


# -- memory ---------------------------------------------------------------------------------------------------
def _row_pointer(context, builder, array_type, array, row, width):
    """Rows are aligned to the double only: an unaligned instruction on aligned memory costs nothing."""
    data = context.make_array(array_type)(context, builder, array).data
    first = builder.gep(data, [builder.mul(row, ir.Constant(_LONG, width))])
    return builder.bitcast(first, ir.VectorType(_DOUBLE, width).as_pointer())


@instruction
def load(typing, lanes, array, row):
    """The row of an array as a vector."""

    def generate(context, builder, sig, args):
        pointer = _row_pointer(context, builder, sig.args[1], args[1], args[2], lanes.width)
        return builder.load(pointer, align=8)

    return Vector(lanes.width, lanes.fma)(lanes, array, types.int64), generate


@instruction
def store(typing, array, row, value):
    """Write a vector into a row."""

    def generate(context, builder, sig, args):
        pointer = _row_pointer(context, builder, sig.args[0], args[0], args[1], value.width)
        builder.store(args[2], pointer, align=8)
        return context.get_dummy_value()

    return types.void(array, types.int64, value), generate


@instruction
def splat(typing, lanes, value):
    """The same number in every lane."""

    def generate(context, builder, sig, args):
        return _splat(builder, args[1], lanes.width)

    return Vector(lanes.width, lanes.fma)(lanes, types.float64), generate


def _splat(builder, scalar, width):
    nothing = ir.Constant(ir.VectorType(scalar.type, width), ir.Undefined)
    vector = builder.insert_element(nothing, scalar, ir.Constant(ir.IntType(32), 0))
    where = ir.Constant(ir.VectorType(ir.IntType(32), width), None)
    return builder.shuffle_vector(vector, vector, where)


def constant_vector(value, width):
    """A constant as LLVM writes it."""
    return ir.Constant(ir.VectorType(_DOUBLE, width), [float(value)] * width)


# -- arithmetic -----------------------------------------------------------------------------------------------
def call_intrinsic(builder, name, *args):
    """Call LLVM's vector intrinsic ``llvm.<name>``."""
    vector = args[0].type
    function_type = ir.FunctionType(vector, [vector] * len(args))
    full = f"llvm.{name}.v{vector.count}f64"
    return builder.call(get_or_insert_function(builder.module, function_type, full), args)


def multiply_add(builder, a, b, c, fma):
    """a·b + c; without the instruction, LLVM's own fma would call a library function for every lane."""
    return call_intrinsic(builder, "fma", a, b, c) if fma else builder.fadd(builder.fmul(a, b), c)


@instruction
def fma(typing, a, b, c):
    """a·b + c."""

    def generate(context, builder, sig, args):
        x, y, z = args
        return multiply_add(builder, x, y, z, a.fma)

    return a(a, a, a), generate


@instruction
def product_error(typing, a, b, product):
    """a·b - product exactly, for the rounded product; by Dekker's splitting where no instruction is fused."""

    def generate(context, builder, sig, args):
        x, y, p = args
        if a.fma:
            return call_intrinsic(builder, "fma", x, y, builder.fneg(p))

        def split(v):
            c = builder.fmul(constant_vector(2.0**27 + 1, a.width), v)
            high = builder.fsub(c, builder.fsub(c, v))
            return high, builder.fsub(v, high)

        (x1, x2), (y1, y2) = split(x), split(y)
        rest = builder.fsub(builder.fmul(x1, y1), p)
        rest = builder.fadd(builder.fadd(rest, builder.fmul(x1, y2)), builder.fmul(x2, y1))
        return builder.fadd(rest, builder.fmul(x2, y2))

    return a(a, a, a), generate


@instruction
def select(typing, mask, yes, no):
    """`yes` where the mask holds, `no` elsewhere."""

    def generate(context, builder, sig, args):
        return builder.select(*args)

    return yes(mask, yes, yes), generate


@instruction
def sqrt(typing, a):
    """The square root."""

    def generate(context, builder, sig, args):
        return call_intrinsic(builder, "sqrt", *args)

    return a(a), generate


@instruction
def maximum(typing, a, b):
    """The larger one; b where a comparison with a NaN is false."""

    def generate(context, builder, sig, args):
        return builder.select(builder.fcmp_ordered(">", *args), *args)

    return a(a, a), generate


@instruction
def minimum(typing, a, b):
    """The smaller one; b where a comparison with a NaN is false."""

    def generate(context, builder, sig, args):
        return builder.select(builder.fcmp_ordered("<", *args), *args)

    return a(a, a), generate


@instruction
def rough_reciprocal(typing, a):
    """1/a for positive a within one per cent, without a division.

    Subtracting the bits of a double from a constant gives a reciprocal within twelve per cent; one Newton step
    squares that. Good enough for weights, and ten times faster than dividing.
    """

    def generate(context, builder, sig, args):
        longs = ir.VectorType(_LONG, a.width)
        magic = ir.Constant(longs, [0x7FDE623822FC16E6] * a.width)
        guess = builder.bitcast(builder.sub(magic, builder.bitcast(args[0], longs)), args[0].type)
        minus = builder.fneg(args[0])
        rest = multiply_add(builder, minus, guess, constant_vector(2, a.width), a.fma)
        return builder.fmul(guess, rest)

    return a(a), generate


@instruction
def two_to_the(typing, a):
    """2**a for whole numbers a between -1000 and 1000."""

    def generate(context, builder, sig, args):
        longs = ir.VectorType(_LONG, a.width)
        exponent = builder.add(builder.fptosi(args[0], longs), ir.Constant(longs, [1023] * a.width))
        return builder.bitcast(builder.shl(exponent, ir.Constant(longs, [52] * a.width)), args[0].type)

    return a(a), generate


@instruction
def floor(typing, a):
    """The whole number below."""

    def generate(context, builder, sig, args):
        return call_intrinsic(builder, "floor", *args)

    return a(a), generate


# -- masks ----------------------------------------------------------------------------------------------------
@instruction
def bits(typing, mask):
    """The mask as an integer, lane k in bit k."""

    def generate(context, builder, sig, args):
        return builder.zext(builder.bitcast(args[0], ir.IntType(mask.width)), _LONG)

    return types.int64(mask), generate


@instruction
def call_tick(typing, address, array):
    """Call machine code ``void tick(double *)`` at an address."""

    def generate(context, builder, sig, args):
        data = context.make_array(sig.args[1])(context, builder, args[1]).data
        function = ir.FunctionType(ir.VoidType(), [data.type]).as_pointer()
        builder.call(builder.inttoptr(args[0], function), [data])
        return context.get_dummy_value()

    return types.void(types.int64, array), generate


def _binary(symbol, emit, argument, result=None):
    """Give Python's operator a meaning for two vectors or two masks."""

    @infer_global(symbol)
    class Template(AbstractTemplate):
        key = symbol

        def generic(self, args, keywords):
            if len(args) == 2 and isinstance(args[0], argument) and args[0] == args[1]:
                return signature(result(args[0].width) if result else args[0], *args)
            return None

    @lower_builtin(symbol, argument, argument)
    def lower(context, builder, sig, args):
        return emit(builder, *args)


_binary(operator.add, lambda b, x, y: b.fadd(x, y), Vector)
_binary(operator.sub, lambda b, x, y: b.fsub(x, y), Vector)
_binary(operator.mul, lambda b, x, y: b.fmul(x, y), Vector)
_binary(operator.truediv, lambda b, x, y: b.fdiv(x, y), Vector)
_binary(operator.lt, lambda b, x, y: b.fcmp_ordered("<", x, y), Vector, Mask)
_binary(operator.le, lambda b, x, y: b.fcmp_ordered("<=", x, y), Vector, Mask)
_binary(operator.gt, lambda b, x, y: b.fcmp_ordered(">", x, y), Vector, Mask)
_binary(operator.ge, lambda b, x, y: b.fcmp_ordered(">=", x, y), Vector, Mask)
_binary(operator.and_, lambda b, x, y: b.and_(x, y), Mask)
_binary(operator.or_, lambda b, x, y: b.or_(x, y), Mask)


@instruction
def negative(typing, a):
    """-a."""

    def generate(context, builder, sig, args):
        return builder.fneg(args[0])

    return a(a), generate


@instruction
def outside(typing, mask):
    """The lanes where the mask does not hold."""

    def generate(context, builder, sig, args):
        return builder.not_(args[0])

    return mask(mask), generate


@instruction
def any_lane(typing, mask):
    """Whether the mask holds in any lane."""

    def generate(context, builder, sig, args):
        word = builder.bitcast(args[0], ir.IntType(mask.width))
        return builder.icmp_unsigned("!=", word, ir.Constant(word.type, 0))

    return types.boolean(mask), generate
