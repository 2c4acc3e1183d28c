"""Tick programs: elimination against NumPy, machine code and bytecode against the replayed program."""

import ctypes
import pickle

import numpy as np
import pytest
from kernel_systems import katsura

from solvers.graph import Builder
from solvers.kernel import codegen, interpreter
from solvers.kernel.elimination import depth_first, elimination_length, pivot_order, tick_program
from solvers.kernel.interpreter import bytecode
from solvers.kernel.lanes import Lanes
from solvers.kernel.layout import layout, workspace
from solvers.system import evaluate
from solvers.tape import ARITY, INV

ALL = [Lanes(2), Lanes(2, fma=False), Lanes(4), Lanes(4, fma=False), Lanes(8)]


@pytest.fixture(autouse=True)
def own_cache(tmp_path, monkeypatch):
    monkeypatch.setenv("EVERYLINKAGE_CACHE", str(tmp_path))


def gauss(seed, *shape):
    rng = np.random.default_rng(seed)
    return rng.normal(size=shape) + 1j * rng.normal(size=shape)


def every_operation():
    """A program with each instruction, on complex constants, real constants and imaginary ones."""
    b = Builder(2, 1)
    x, y, p, v = b.unknown(0), b.unknown(1), b.parameter(0), b.velocity(0)
    i, three, c = b.constant(1j), b.constant(3), b.constant(0.5 - 2j)
    product = b.multiply(x, y)
    values = [
        b.add(b.multiply(x, p), y),
        b.sub(b.multiply(x, v), p),
        b.sub(y, b.multiply(p, p)),
        b.negate(b.add(product, b.multiply(three, x))),
        b.multiply(i, b.invert(b.add(x, c))),
        b.add(b.square(b.sub(x, i)), b.multiply(c, product)),
        b.invert(three),
        b.multiply(b.add(x, y), b.sub(product, three)),
    ]
    return b.finish({"dx": values[:4], "dr": values[4:]})


def run_machine_code(program, lanes, x, p, v):
    tick = codegen.Tick(program, lanes)
    at = layout(program.unknowns, program.parameters)
    work = workspace(at.dx + 2 * len(program.outputs["dx"]) * 2, lanes.width)
    rows = work.reshape(-1, lanes.width)
    leaves = np.concatenate([x, p, v])
    rows[: 2 * len(leaves) : 2], rows[1 : 2 * len(leaves) : 2] = leaves.real, leaves.imag
    ctypes.CFUNCTYPE(None, ctypes.c_void_p)(tick.address)(work.ctypes.data)
    results = rows[2 * len(leaves) :]
    return results[0::2] + 1j * results[1::2]


@pytest.mark.parametrize("lanes", ALL, ids=str)
def test_machine_code_does_what_the_program_says(lanes):
    program = every_operation()
    x, p, v = gauss(1, 2, lanes.width), gauss(2, 1, lanes.width), gauss(3, 1, lanes.width)
    expected = program.replay(list(x), list(p), list(v))
    expected = np.array([np.broadcast_to(value, lanes.width) for name in ("dx", "dr") for value in expected[name]])
    found = run_machine_code(program, lanes, x, p, v)
    assert np.abs(found - expected).max() < 1e-13 * np.abs(expected).max()


def test_without_the_instruction_no_fused_multiplication_is_called():
    program = every_operation()
    assert "@llvm.fma" not in codegen.assembly(program, Lanes(4, fma=False))
    assert "@llvm.fma" in codegen.assembly(program, Lanes(4, fma=True))


@pytest.mark.parametrize(
    ("triple", "cpu", "lanes", "instruction"),
    [
        ("aarch64-unknown-linux-gnu", "generic", Lanes(2), "fmla"),
        ("x86_64-unknown-linux-gnu", "haswell", Lanes(4), "vfmadd"),
        ("x86_64-unknown-linux-gnu", "x86-64", Lanes(2, fma=False), "mulpd"),
        ("x86_64-unknown-linux-gnu", "skylake-avx512", Lanes(8), "zmm"),
    ],
)
def test_other_processors_get_their_vector_instructions(triple, cpu, lanes, instruction):
    llvm = pytest.importorskip("llvmlite.binding")
    llvm.initialize_all_targets()
    llvm.initialize_all_asmprinters()
    module = llvm.parse_assembly(codegen.assembly(every_operation(), lanes))
    machine = llvm.Target.from_triple(triple).create_target_machine(cpu=cpu, opt=2)
    text = machine.emit_assembly(module)
    assert instruction in text
    assert not any(word in text for word in ("call", "\tbl\t"))  # nothing is left to a library


def test_finished_code_is_kept_and_a_damaged_file_is_made_again(tmp_path):
    program = every_operation()
    assert not codegen.is_cached(program, Lanes(2))
    assert not codegen.Tick(program, Lanes(2)).cached
    assert codegen.is_cached(program, Lanes(2))
    assert codegen.Tick(program, Lanes(2)).cached
    (file,) = tmp_path.glob("*.o")
    content = bytearray(file.read_bytes())
    content[len(content) // 2] ^= 1
    file.write_bytes(bytes(content))
    assert not codegen.Tick(program, Lanes(2)).cached
    assert codegen.Tick(program, Lanes(2)).cached


def test_a_cache_that_cannot_be_written_costs_only_time(tmp_path, monkeypatch):
    file = tmp_path / "file"
    file.write_text("in the way")
    monkeypatch.setenv("EVERYLINKAGE_CACHE", str(file))
    assert codegen.Tick(every_operation(), Lanes(2)).address


def test_other_constants_are_other_code():
    keys = set()
    for value in (1, 2, 1 + 1e-15):
        b = Builder(1, 0)
        b_x = b.multiply(b.unknown(0), b.constant(value + 0.5))
        keys.add(codegen._key(b.finish({"dx": [b_x], "dr": [b_x]}), Lanes(2)))
    assert len(keys) == 3


def test_one_tick_is_one_newton_step_and_one_tangent():
    engine, starts, base, direction = katsura(4)
    x = starts + 0.1 * gauss(4, *starts.shape)
    p = base + 0.4 * direction
    out = engine.tick.replay(list(x.T), list(p), list(direction))
    F, J = evaluate(engine.program, x, p)
    Ft = np.array(
        [np.broadcast_to(v, len(x)) for v in engine.program.replay(list(x.T), list(p), list(direction))["Ft"]]
    )
    assert np.abs(np.array(out["dx"]).T - np.linalg.solve(J, F[:, :, None])[:, :, 0]).max() < 1e-9
    assert np.abs(np.array(out["dr"]).T + np.linalg.solve(J, Ft.T[:, :, None])[:, :, 0]).max() < 1e-9


def arrow(blocks):
    """Two unknowns common to all equations, and a unit pair of its own for each block."""
    b = Builder(2 + 2 * blocks, 2 * blocks)
    u, w = b.unknown(0), b.unknown(1)
    equations = []
    for k in range(blocks):
        t, s = b.unknown(2 + 2 * k), b.unknown(3 + 2 * k)
        p, q = b.parameter(2 * k), b.parameter(2 * k + 1)
        equations += [
            b.sub(b.multiply(u, t), b.multiply(p, s)),
            b.sub(b.multiply(w, s), b.add(b.multiply(q, t), b.square(u))),
        ]
    equations += [b.sub(b.multiply(u, w), b.unknown(2)), b.sub(b.square(w), b.add(b.unknown(3), u))]
    return b, equations


def test_a_block_arrow_is_eliminated_block_by_block():
    lengths = []
    for blocks in (4, 8, 16):
        b, equations = arrow(blocks)
        from solvers.system import differentiated

        program = differentiated(b, equations)
        _, J = evaluate(program, gauss(1, 3, b.unknowns), gauss(2, b.parameters))
        order = pivot_order(program.pattern, J)
        lengths.append(elimination_length(program.pattern, order))
        tick = tick_program(b, equations, order)
        x = gauss(5, 2, b.unknowns)
        F, J = evaluate(program, x, gauss(2, b.parameters))
        dx = np.array(tick.replay(list(x.T), list(gauss(2, b.parameters)))["dx"]).T
        assert np.abs(dx - np.linalg.solve(J, F[:, :, None])[:, :, 0]).max() < 1e-8
    # linear in the number of blocks, where a dense elimination would grow by eight
    assert lengths[2] - lengths[1] < 2.2 * (lengths[1] - lengths[0])


def test_depth_first_changes_the_order_and_nothing_else():
    engine, starts, base, direction = katsura(3)
    again = depth_first(engine.tick)
    a, b = (program.replay(list(starts.T), list(base), list(direction)) for program in (engine.tick, again))
    assert all(np.array_equal(x, y) for x, y in zip(a["dx"] + a["dr"], b["dx"] + b["dr"]))
    for k, (op, *operands) in enumerate(again.code.tolist()):
        assert all(slot < again.inputs + k for slot in operands[: ARITY[op]])


def test_bytecode_of_long_programs_uses_rows_again(monkeypatch):
    engine, starts, *line = katsura(6)
    engine.prefer = "interpreted"
    plain = engine.track(starts[:9], *line)
    first = layout(engine.program.unknowns, engine.program.parameters).slots
    assert bytecode(engine.tick, ("dx", "dr"), first).rows - first > 2 * len(engine.tick.code)
    monkeypatch.setattr(interpreter, "SHORT", 0)
    packed = bytecode(engine.tick, ("dx", "dr"), first)
    assert len(packed.code) == len(engine.tick.code)
    assert packed.rows - first < 2 * len(engine.tick.code) / 2
    assert packed.code[:, 1].min() >= first + 2 * len(engine.tick.constants)
    again = pickle.loads(pickle.dumps(engine))  # forgets its bytecode
    assert np.array_equal(again.track(starts[:9], *line).x, plain.x)


def test_a_singular_pattern_is_refused():
    pattern = np.array([[0, 0], [1, 0]])
    with pytest.raises(np.linalg.LinAlgError, match="structurally singular"):
        pivot_order(pattern, np.ones((1, 2, 2)))


def test_inverse_of_a_number_far_from_one():
    b = Builder(1, 0)
    program = b.finish({"dx": [b.invert(b.unknown(0))], "dr": [b.one]})
    assert INV in program.code[:, 0]
    found = run_machine_code(program, Lanes(2), np.array([[1e-120 + 1e-121j, 3e120j]]), *np.zeros((2, 0, 2)))
    assert np.abs(found[0] * np.array([1e-120 + 1e-121j, 3e120j]) - 1).max() < 1e-15
