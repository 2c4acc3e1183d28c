"""The zoo says what its sources say: a published solution of each system, and published degrees."""

import numpy as np
import pytest
import sympy

from benchmarks.check_roots import Judge
from benchmarks.zoo import ZOO
from solvers.system import System

#: One solution of each, as printed in PHCpack's demonstration database; E. g. "re im" for complex coordinates.
PUBLISHED = {
    "noon3": [1.35560902253960, -0.6778045112698 - 0.527500584353303j, -0.6778045112698 + 0.527500584353303j],
    "eco5": [0.79479960525112, -1.14417041381173, 0.0305149904685739, -0.681144181907962, -5.87247180001677],
    "chandra6": [
        *(1.13154550436088, 1.18203024240421, 1.21673759622537),
        *(1.24247204712991, 1.26245248469364, 1.27847129867409),
    ],
    "reimer5": [0.165179856275237, 0.371809860927029, 0.600580975840425, 0.806590703105641, 0.949130782115133],
    "caprasse": [-3.86370330515627, -1.0, -3.86370330515627, -1.0],
    "cassou": [
        *(-6.68640299606734e-3 + 8.94855573620861e-2j, 56.2348716108504 + 79.8084362941689j),
        *(10.9694720379898 - 50.8259658932153j, -7.52233440839102e-2 - 5.99175264541474e-2j),
    ],
    "boon": [
        *(-0.402451939639181, -0.915441115681758, 0.915441115681758),
        *(0.402451939639181, -1.44169513021472, 1.44169513021472),
    ],
    "heart": [
        *(-0.0105327487539249, 0.643072748753925, 0.267509958538160, -1.61284995853816),
        *(1.16524580543429, -0.955135340644462, -0.352909859613675, -0.188763344076624),
    ],
    "virasoro": [
        *(0.05, 0.05, -0.0509615384615385, 0.05, 0.05),
        *(-0.0440261467514519, 0.0190261467514519, 0.0836538461538462),
    ],
    "d1": [
        *(-0.389415083856842, -0.921062371647419, 0.575259014495853, -0.817971311380332),
        *(0.808477989701551, -0.588526414163492, 0.627366977109340, -0.778723748214146),
        *(0.984086361717633, 0.177690834545149, 0.940301932754719, -0.340341409848611),
    ],
    "ipp": [
        *(0.890263062473586, 0.455446681396573, 0.993548991629860, 0.113403709072009),
        *(0.683993578531617, -0.729488029050177, -0.650842505342338, -0.759212772047276),
    ],
    "ipp2": [
        *(0.681970587371378 - 0.301278759670484j, -0.994245757505745 + 0.323318560369258j),
        *(1.54317164315374 + 1.22732850162926j, 2.81049048704997 - 2.10543814021222j),
        *(-1.63885386351178 - 2.45496893479488j, 0.0745430227704065 - 0.784645108001499j),
        *(-2.18970540639891 + 1.72598710872434j, 1.93298656378182 + 1.98547325336408j),
        *(-0.485810385366990 - 0.0191577771101302j, 0.802040331104181 + 0.895211069183146j),
        1.14998861063535 - 0.632443158732329j,
    ],
    "stewart": [
        *(0.863325713770891, 0.00564402867997359, -0.504615553547690),
        *(0.191288333012351, 0.943756501770663, 0.269689523376340),
        *(-0.727039337601767, -0.0483533608080227, 0.684891052707037),
    ],
    "rbpl24": [
        *(0.260927915037453 + 0.851188283602750j, 0.296903318580811 - 0.223600559834163j),
        *(1.35057031555164 - 0.115292801937443j, -0.3971875, 1.58367243700197 + 0.231508118725500j),
        *(-0.967226981458723 + 0.379055830323113j, 0.501336328968350 + 1.89993451405436j),
        *(-0.925382696154252 + 0.275038127785784j, 0.637698531378697 - 0.616577442932776j),
    ],
    "fourbar5": [
        *(0.537811114799385 - 1.06123913869852j, 0.537811114799386 + 1.06123913869852j),
        *(-0.0805270444664818 - 0.354549318016547j, -0.0805270444664817 + 0.354549318016547j),
    ],
}


@pytest.mark.parametrize("name", PUBLISHED)
def test_published_solutions_solve(name):
    point = np.array([PUBLISHED[name]])
    values, jacobian = ZOO[name].build().evaluate(point)
    step = np.linalg.solve(jacobian[0], values[0])
    assert np.abs(step).max() < 1e-8 * np.abs(point).max()


@pytest.mark.parametrize("name", [name for name, benchmark in ZOO.items() if benchmark.total_degree])
def test_published_total_degrees(name):
    assert ZOO[name].build().bezout == ZOO[name].total_degree


def test_five_poses_of_burmester():
    """Two of the four dyads of the regression set, fixed pivot g and moving point z."""
    system = ZOO["burmester"].build()
    for g, z in (
        (-1.6874789503 - 1.7809118296j, -1.7559332762 + 0.2946847085j),
        (2.3353009543 + 0.3550839741j, 1.9611255331 - 1.2317089267j),
    ):
        values, jacobian = system.evaluate([[z, z.conjugate(), g, g.conjugate()]])
        assert np.abs(np.linalg.solve(jacobian[0], values[0])).max() < 1e-9


def test_trivial_and_published_roots_of_the_watt_linkage():
    system = ZOO["watt2"].build()
    for first, second in ((0, 0), (-45, -30), (-60, -45), (-5.908323303, -13.575766579)):
        x, y = np.exp(1j * np.radians([first, second]))
        values, jacobian = system.evaluate([[x, y, x.conjugate(), y.conjugate()]])
        assert np.abs(np.linalg.solve(jacobian[0], values[0])).max() < 1e-9


def test_the_judge_tells_roots_from_points_nearby():
    x, y = sympy.symbols("x y")
    judge = Judge(System([(x**2 - 2) * (x - 1), x * y - 1], [x, y]))
    root = [2**0.5, 2**-0.5]
    verdict = judge([root, root, [1.0, 1.0], [1.01, 1.0], [np.nan, 1], [3.0, 3.0]])
    assert (verdict.returned, verdict.accepted, verdict.distinct, verdict.duplicates) == (6, 3, 2, 1)


def test_the_judge_refuses_singular_points():
    x = sympy.Symbol("x")
    assert Judge(System([x**2], [x]))([[0.0], [1e-9]]).accepted == 0
