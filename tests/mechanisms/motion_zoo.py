"""Linkages on which motion is tested, with the published source of those that have one."""

from __future__ import annotations

import cmath
import math

import numpy as np

from mechanisms.linkage import Input, Linkage, PinSlot


def meet(a: complex, ra: float, b: complex, rb: float, side: int = 1) -> complex:
    """Return the point at distance ra from a and rb from b, to the left (side 1) or right (−1) of a→b."""
    d = abs(b - a)
    x = (d * d + ra * ra - rb * rb) / (2 * d)
    return a + (b - a) / d * (x + 1j * side * math.sqrt(ra * ra - x * x))


def four_bar(ground, crank, coupler, follower, crank_angle=1.0, side=1):
    """Four-bar from its lengths and the crank's angle."""
    b = crank * cmath.exp(1j * crank_angle)
    return four_bar_at(0, b, meet(b, coupler, ground, follower, side), ground)


def four_bar_at(a, b, c, d):
    """Four-bar from its joints, a and d fixed."""
    return Linkage(
        points={"A": a, "B": b, "C": c, "D": d},
        links={"ground": "AD", "crank": "AB", "coupler": "BC", "follower": "CD"},
        inputs={name: Input(name) for name in ("crank", "coupler", "follower")},
    )


def two_effector_watt2(w1, z1, w2, z2, w3, z3, w4, z4):
    """Watt II with two effectors (Kiper, Motion synthesis of a planar Watt II type six-bar mechanism)."""
    o1 = -(w1 + z1)
    q = o1 + w2 + z2
    return Linkage(
        points={
            "O1": o1, "A": o1 + w1, "A'": o1 + w2, "P": 0, "Q": q,
            "O3": -(w3 + z3), "C": -z3, "O4": q - (w4 + z4), "C'": q - z4,
        },
        links={
            "ground": ("O1", "O3", "O4"),
            "crank": ("O1", "A", "A'"),
            "P-coupler": ("A", "P", "C"),
            "Q-coupler": ("A'", "Q", "C'"),
            "P-rocker": ("O3", "C"),
            "Q-rocker": ("O4", "C'"),
        },
        bodies={"P": ("P-coupler", "P"), "Q": ("Q-coupler", "Q")},
        inputs={name: Input(name) for name in ("crank", "P-rocker", "Q-rocker")},
    )  # fmt: skip


def watt2_poses(beta, alpha, gamma, eta, phi):
    """Poses of that linkage from its five rotations in degrees, without the zero ones of the reference."""
    names = ("crank", "P-coupler", "Q-coupler", "P-rocker", "Q-rocker")
    rows = np.radians(np.array([beta, alpha, gamma, eta, phi], dtype=float)).T
    return [dict.fromkeys(names, 0.0)] + [dict(zip(names, map(float, row))) for row in rows]


#: Poses of Table 4 of Suárez-Velásquez et al., Synthesis of a novel planar linkage to visit up to eight
#: poses, 2018.
TABLE_4 = [
    (0.00, 0.00, 90.00), (0.45, 0.24, 77.36), (1.32, 0.42, 55.03), (2.29, 0.17, 30.20),
    (2.88, -0.43, 10.03), (2.95, -0.97, 1.71), (2.60, -1.26, 10.03), (1.93, -1.57, 30.20),
]  # fmt: skip

#: Tables 5, 6 and 7 of the same paper; the last entry is how many poses of Table 4 are meant.
WANZER = {
    5: {
        "B": 1.9791 + 0.2393j,
        "C": -0.6422j,
        "Q": 1.3258 - 1.8860j,
        "M": -0.6476 + 0.6j,
        "N": -2.3886 - 3.25j,
        "e": 0.6259,
        "f": 2.4334,
        "g": 1.8,
        "MR": 1.0570,
        "NS": 2.2288,
        "theta0": 0.0,
        "poses": 6,
    },
    6: {
        "B": 1.7931 - 0.0273j,
        "C": 1.2916 - 1.0358j,
        "Q": 1.5249 - 1.5556j,
        "M": 0.3259 + 2.0997j,
        "N": -1.3909 - 1.75j,
        "e": 2.3850,
        "f": 1.1688,
        "g": 1.8,
        "MR": 1.1179,
        "NS": 1.8230,
        "theta0": 0.0,
        "poses": 7,
    },
    7: {
        "B": -1.0555 - 3.1004j,
        "C": 3.6548 - 0.7435j,
        "Q": 3.5231 - 3.3015j,
        "M": 2.4618 + 2.6287j,
        "N": 6.3114 - 6.8307j,
        "e": 2.8766,
        "f": 0.2351,
        "g": 2.2857,
        "MR": 2.1484,
        "NS": 10.5636,
        "theta0": -2.8999,
        "poses": 8,
    },
}


def wanzer(table):
    """Return the modified Wanzer linkage of a table of that paper and its poses, from the printed numbers."""
    d = WANZER[table]
    theta0 = math.radians(d["theta0"])
    a0 = 2.0 * cmath.exp(1j * math.radians(240))
    rows = []
    for x, y, beta in TABLE_4[: d["poses"]]:
        phi, p = math.radians(beta - 90), complex(x, y)
        turn = cmath.exp(1j * phi)
        gb, gc, gb0, gc0 = p + turn * d["B"] - d["Q"], p + turn * d["C"] - d["Q"], d["B"] - d["Q"], d["C"] - d["Q"]
        u, v = cmath.exp(1j * theta0), 1j * cmath.exp(1j * theta0)
        k10, k20 = (gb0 * v.conjugate()).real, (gc0 * u.conjugate()).real
        delta = (gb * gc.conjugate()).real
        sine = (gb.imag * k20 - k10 * gc.real) / delta
        cosine = (gb.real * k20 + gc.imag * k10) / delta
        theta = math.atan2(sine, cosine)
        a = p + turn * a0
        eta = _coupler_angle(a, d)
        r = a + cmath.exp(1j * eta) * complex(-d["e"], -d["g"])
        s = a + cmath.exp(1j * eta) * complex(d["f"], -d["g"])
        rows.append((phi, theta, eta, cmath.phase(r - d["M"]), cmath.phase(s - d["N"]), r, s))
    r0, s0 = rows[0][5], rows[0][6]
    linkage = Linkage(
        points={
            "P": 0,
            "A": a0,
            "B": d["B"],
            "C": d["C"],
            "Q": d["Q"],
            "M": d["M"],
            "N": d["N"],
            "R": r0,
            "S": s0,
        },
        links={
            "ground": ("M", "N", "Q"),
            "crank": ("M", "R"),
            "coupler": ("R", "S", "A"),
            "follower": ("N", "S"),
            "body": ("P", "A", "B", "C"),
            "disc": ("Q",),
        },
        slots=[
            PinSlot("disc", "B", cmath.exp(1j * theta0)),
            PinSlot("disc", "C", 1j * cmath.exp(1j * theta0)),
        ],
        bodies={"P": ("body", "P")},
        inputs={"crank": Input("crank"), "disc": Input("disc")},
    )
    first = rows[0]
    poses = [
        {
            "body": phi - first[0],
            "disc": theta - first[1],
            "coupler": eta - first[2],
            "crank": crank - first[3],
            "follower": follower - first[4],
        }
        for phi, theta, eta, crank, follower, _, _ in rows
    ]
    return linkage, poses


def _coupler_angle(a, d):
    """Angle η of the four-bar's coupler when its point A is at a: the paper's equations (19), solved for η."""
    lengths = {"M": (d["M"], d["MR"], -d["e"]), "N": (d["N"], d["NS"], d["f"])}
    rows, right = [], []
    for pivot, length, side in lengths.values():
        # |a + e^{iη} w − pivot|² = length² with w = side − ig: linear in cos η and sin η.
        w, z = complex(side, -d["g"]), a - pivot
        rows.append([2 * (w * z.conjugate()).real, -2 * (w * z.conjugate()).imag])
        right.append(length**2 - abs(z) ** 2 - abs(w) ** 2)
    cosine, sine = np.linalg.solve(rows, right)
    return math.atan2(sine, cosine)


def robomech():
    """A RoboMech class manipulator with two end-effectors C and F, standing at φ7 = 90°.

    The structure is that of the paper in IAENG Int. J. of Applied Mathematics 50(2), 2020; the dimensions
    are chosen so that the joints of this configuration have short coordinates.
    """

    def arm(origin, length, degrees):
        return origin + length * cmath.exp(1j * math.radians(degrees))

    b, e = arm(0, 2, 115), arm(6, 2.1, 62)
    return Linkage(
        points={
            "A": 0, "D": 6, "K": 3 - 0.5j, "B": b, "E": e, "C": arm(b, 2.6, 35), "F": arm(e, 2.5, 140),
            "G": 1.4 + 1.9j, "I": 4.7 + 1.9j, "H": 3 + 0.5j, "L": -1 + 0.7j, "M": 1.5 + 0.6j,
            "Q": 7 + 0.8j, "N": 4.4 + 0.6j,
        },
        links={
            "ground": "ADK", "1": "ABL", "2": "BCG", "3": "DEQ", "4": "EFI",
            "5": "GHM", "6": "IHN", "7": "KH", "8": "LM", "9": "NQ",
        },
        bodies={"C": ("2", "C"), "F": ("4", "F")},
        inputs={"7": Input("7")},
    )  # fmt: skip


_WATT = {"t": "abc", "u": "ade", "k": "bf", "l": "fd", "m": "cg", "n": "ge"}
_STEPHENSON = {"t": "abc", "u": "def", "k": "ad", "l": "be", "m": "cg", "n": "gf"}
#: Six-bar kind to (chain, link that is the ground).
SIX_BARS = {
    "Watt I": (_WATT, "k"),
    "Watt II": (_WATT, "t"),
    "Stephenson I": (_STEPHENSON, "k"),
    "Stephenson II": (_STEPHENSON, "m"),
    "Stephenson III": (_STEPHENSON, "t"),
}


def six_bar(kind, rng):
    """A six-bar of a kind with random dimensions, driven by each link that is pinned to the ground."""
    chain, frame = SIX_BARS[kind]
    points = {name: complex(*rng.normal(size=2)) for name in sorted(set("".join(chain.values())))}
    links = {"ground" if name == frame else name: tuple(members) for name, members in chain.items()}
    pinned = [name for name in links if name != "ground" and set(links[name]) & set(links["ground"])]
    return Linkage(points, links, inputs={name: Input(name) for name in pinned})


#: The three-pose example of that paper by Kiper: displacements and rotations (degrees) of P and Q.
KIPER = {
    "dPQ": 45 + 15j,
    "dP": (15 + 5j, 25 + 10j),
    "dQ": (20 + 10j, 30 + 5j),
    "alpha": (-45.0, -30.0),
    "gamma": (-60.0, -45.0),
}


def dyad(first, second, displacement):
    """W and Z from W (e^{i first} − 1) + Z (e^{i second} − 1) = displacement at two poses; angles in degrees."""
    rows = np.exp(1j * np.radians(np.array([first, second]).T)) - 1
    return np.linalg.solve(rows, np.array(displacement, dtype=complex))


def kiper_closure(beta, data=KIPER):
    """W2 + Z2 − W1 − Z1 − dPQ for two rotations (degrees) of the common crank, times the denominators."""
    w1, z1 = dyad(beta, data["alpha"], data["dP"])
    w2, z2 = dyad(beta, data["gamma"], data["dQ"])
    return w2 + z2 - w1 - z1 - data["dPQ"]


def kiper_crank_rotations():
    """The three real (β2, β3) of that example in degrees, refined from rounded values."""
    found = []
    for start in ((-118.0, -65.0), (-6.0, -13.6), (15.2, 11.5)):
        beta = np.array(start)
        for _ in range(30):
            value = kiper_closure(beta)
            slopes = [(kiper_closure(beta + h) - value) / 1e-6 for h in (np.array([1e-6, 0]), np.array([0, 1e-6]))]
            matrix = np.array([[s.real for s in slopes], [s.imag for s in slopes]])
            beta = beta - np.linalg.solve(matrix, [value.real, value.imag])
        assert abs(kiper_closure(beta)) < 1e-9
        found.append(tuple(beta))
    return found


def kiper_design(beta, eta, phi):
    """Linkage and poses of the three-pose example for rotations of crank and rockers, in degrees."""
    data = KIPER
    pairs = [(beta, "alpha", "dP"), (beta, "gamma", "dQ"), (eta, "alpha", "dP"), (phi, "gamma", "dQ")]
    vectors = [dyad(first, data[second], data[shift]) for first, second, shift in pairs]
    linkage = two_effector_watt2(*(v for pair in vectors for v in pair))
    return linkage, watt2_poses(beta, data["alpha"], data["gamma"], eta, phi)
