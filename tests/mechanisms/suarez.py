"""What the paper on the modified Wanzer linkage prints: poses (Table 4) and designs (Tables 5, 6, 7).

Suárez-Velásquez, Cervantes-Sánchez, Rico-Martínez, Synthesis of a novel planar linkage to visit up to eight poses,
Mech. Based Des. Struct. Mach. 46(6), 2018.
"""

import numpy as np

X = (0.00, 0.45, 1.32, 2.29, 2.88, 2.95, 2.60, 1.93)
Y = (0.00, 0.24, 0.42, 0.17, -0.43, -0.97, -1.26, -1.57)
BETA_DEG = (90.00, 77.36, 55.03, 30.20, 10.03, 1.71, 10.03, 30.20)
POINTS = np.array(X) + 1j * np.array(Y)
TURNS = np.radians(np.array(BETA_DEG) - 90.0)
#: Eq. (18): A from P, with L_AP = 2, delta = 240°.
A_POINTS = POINTS + 2.0 * np.exp(1j * np.radians(np.array(BETA_DEG) + 240.0 - 90.0))

TABLE_5 = {
    "x_B": 1.9791, "y_B": 0.2393, "x_C": 0.0000, "y_C": -0.6422, "x_Q": 1.3258, "y_Q": -1.8860, "theta_0": 0.0,
    "a": -2.1252, "b": 1.3258, "x_M": -0.6476, "y_M": 0.6000, "x_N": -2.3886, "y_N": -3.2500, "e": 0.6259,
    "f": 2.4334, "g": 1.8000, "L_MR": 1.0570, "L_NS": 2.2288,
}  # fmt: skip
TABLE_6 = {
    "x_B": 1.7931, "y_B": -0.0273, "x_C": 1.2916, "y_C": -1.0358, "x_Q": 1.5249, "y_Q": -1.5556, "theta_0": 0.0,
    "a": -1.5284, "b": 0.2333, "x_M": 0.3259, "y_M": 2.0997, "x_N": -1.3909, "y_N": -1.7500, "e": 2.3850,
    "f": 1.1688, "g": 1.8000, "L_MR": 1.1179, "L_NS": 1.8230,
}  # fmt: skip
TABLE_7 = {
    "x_B": -1.0555, "y_B": -3.1004, "x_C": 3.6548, "y_C": -0.7435, "x_Q": 3.5231, "y_Q": -3.3015,
    "theta_0": float(np.radians(-2.8999)), "a": 0.0306, "b": -0.0023, "x_M": 2.4618, "y_M": 2.6287,
    "x_N": 6.3114, "y_N": -6.8307, "e": 2.8766, "f": 0.2351, "g": 2.2857, "L_MR": 2.1484, "L_NS": 10.5636,
}  # fmt: skip
#: What Table 2 chooses for six, seven and eight poses.
TRAMMEL_CHOICES = {6: ("x_C", "theta_0"), 7: ("theta_0",), 8: ()}
CURVE_CHOICES = {6: ("y_M", "y_N", "g"), 7: ("y_N", "g"), 8: ("g",)}
