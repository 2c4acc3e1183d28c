"""Reading the frozen paths in nasty/: a program, start points, a line of parameters, and the ends."""

import json
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path

import numpy as np

from solvers.graph import Builder
from solvers.homotopy import Homotopy, parameter_homotopy
from solvers.kernel.engine import Engine, make_engine
from solvers.tape import Program

FOLDER = Path(__file__).parent / "nasty"


@dataclass
class Nasty:
    """A frozen path, or a few that belong together."""

    program: Program
    start: np.ndarray
    base: np.ndarray
    direction: np.ndarray
    end: np.ndarray
    data: dict

    @property
    def line(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Start points, base and direction, as the engine takes them."""
        return self.start, self.base, self.direction

    def engine(self) -> Engine:
        builder = Builder(self.program.unknowns, self.program.parameters)
        unknowns = [builder.unknown(k) for k in range(self.program.unknowns)]
        equations = self.program.embed(
            builder, unknowns, [builder.parameter(k) for k in range(self.program.parameters)]
        )
        return make_engine(builder, equations, (self.start, self.base + self.direction))

    def homotopy(self) -> Homotopy:
        return parameter_homotopy(self.program, self.base + self.direction, self.base, self.start)

    def errors(self, points: np.ndarray) -> np.ndarray:
        """Distances from the right ends, relative, shape (paths,)."""
        return np.abs(points - self.end).max(axis=1) / np.abs(self.end).max(axis=1)


def read(path: Path) -> Nasty:
    data = json.loads(path.read_text())
    given = data["program"]
    program = Program(
        unknowns=given["unknowns"],
        parameters=given["parameters"],
        constants=tuple((Fraction(a), Fraction(b)) for a, b in given["constants"]),
        code=np.array(given["code"], np.int32),
        outputs={"F": np.array(given["equations"], np.int32)},
    )
    start, base, direction, end = (np.array(data[name]) @ [1, 1j] for name in ("start", "base", "direction", "end"))
    return Nasty(program, start, base, direction, end, data)
