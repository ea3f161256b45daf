"""The formulas of docs/model.md in plain Python, with the page's symbols.

Each function marked `formula` holds formulas of the page; tests/contract/test_model_page.py requires that
formulas and symbols stand there.
"""

import math
import re
from pathlib import Path

import numpy as np

PAGE = (Path(__file__).parents[2] / "docs" / "model.md").read_text("utf-8")
MATH = [
    " ".join(re.sub(r"```math|```|\$", "", formula).split())
    for formula in re.findall(r"```math\n.*?```|\$[^$]+\$", PAGE, re.DOTALL)
]
CORNERS = ("ll", "lr", "ul", "ur")
MARKS = []

# Names in the functions below, as the page writes them. "d" before a name is a rate.
SYMBOLS = {
    "E_s": r"E_s", "E_g": r"E_g", "ν_s": r"\nu_s", "ν_g": r"\nu_g", "σ_s": r"\sigma_s", "σ_g": r"\sigma_g",
    "R": r"R", "K": r"K", "n": r"n", "c_e": r"c_e", "C": r"C",
    "T": r"T", "L": r"L", "a": r"a", "K_s": r"K_s", "δ": r"\delta", "dδ": r"\dot\delta",
    "δ_1": r"\delta_1", "δ_2": r"\delta_2", "f_1": r"f_1", "v_i": r"v_i", "v_min": r"v_{\min}", "F_n": r"F_n",
    "F_t": r"F_t", "c_f": r"c_f", "c_d": r"c_d", "v_t": r"v_t", "v_0": r"v_0", "v_1": r"v_1", "s_x": r"s_x",
    "s_y": r"s_y", "σ_x": r"\sigma_x", "W_T": r"W_T", "c_T": r"c_T", "x_g": r"x_g", "r_x": r"r_x",
    "r_y": r"r_y", "g_c": r"g_c", "x_5": r"x_5", "dx_5": r"\dot x_5", "dy_5": r"\dot y_5", "θ_5": r"\theta_5",
    "ω_5": r"\omega_5", "F_x": r"F_x", "F_y": r"F_y", "M_5": r"M_5", "A": r"A", "A_": r"A'", "e": r"e",
    "de": r"\dot e", "t": r"t", "c": r"c", "R_j": r"R_j", "R_b": r"R_b", "ω": r"\omega", "ω_2": r"\omega_2",
    "P": r"P", "G": r"G", "U": r"U", "s": r"s", "f_2": r"f_2", "dδ_1": r"\dot\delta_1",
    "k": r"k", "c_max": r"c_{\max}", "d_max": r"d_{\max}", "P_1": r"P_1", "h_1": r"h_1", "q": r"q", "h": r"h",
    "V": r"V", "dδ_2": r"\dot\delta_2", "v_t1": r"v_{t1}", "v_t2": r"v_{t2}",
}  # fmt: skip


def formula(*formulas):
    """Mark a function as these formulas of the page."""

    def mark(function):
        MARKS.append((function, formulas))
        return function

    return mark


@formula(r"\sigma_s = \frac{1 - \nu_s^2}{E_s}", r"\sigma_g = \frac{1 - \nu_g^2}{E_g}")
def compliances(E_s, E_g, ν_s, ν_g):
    σ_s = (1 - ν_s**2) / E_s
    σ_g = (1 - ν_g**2) / E_g
    return σ_s, σ_g


@formula(r"K = \frac{4}{3 (\sigma_s + \sigma_g)} \sqrt{R}")
def point_stiffness(σ_s, σ_g, R):
    return 4 / (3 * (σ_s + σ_g)) * math.sqrt(R)


@formula(r"K_s = \frac{a}{0.475 (\sigma_s + \sigma_g)}", r"a = T + L")
def side_stiffness(σ_s, σ_g, T, L):
    a = T + L
    return a / (0.475 * (σ_s + σ_g))


@formula(r"C = \frac{3}{4} (1 - c_e^2)")
def damping(c_e):
    return 3 / 4 * (1 - c_e**2)


@formula(r"\frac{3}{2} (1 - c_e)")
def hunt_crossley_damping(c_e):
    return 3 / 2 * (1 - c_e)


@formula(r"\frac{8 (1 - c_e)}{5 c_e}")
def flores_damping(c_e):
    return 8 * (1 - c_e) / (5 * c_e)


@formula(r"\frac{1 - c_e^2}{c_e}")
def gonthier_damping(c_e):
    return (1 - c_e**2) / c_e


DAMPING = {
    "lankarani-nikravesh": damping,
    "hunt-crossley": hunt_crossley_damping,
    "flores": flores_damping,
    "gonthier": gonthier_damping,
}


@formula(r"R_j R_b/(R_b - R_j)", r"R_b = R_j + c")
def conformal_radius(R_j, c):
    R_b = R_j + c
    return R_j * R_b / (R_b - R_j)


@formula(
    r"r_x = s_x\cos\theta_5 - s_y\sin\theta_5",
    r"r_y = s_x\sin\theta_5 + s_y\cos\theta_5",
    r"g_c = \sigma_x (x_5 + r_x - x_g) + W_T/2 + c_T, \qquad \delta = -g_c",
    r"\dot\delta = -\sigma_x (\dot x_5 - \omega_5 r_y)",
    r"v_t = \dot y_5 + \omega_5 r_x",
)
def corner_motion(s_x, s_y, σ_x, x_g, W_T, c_T, x_5, θ_5, dx_5, dy_5, ω_5):
    r_x = s_x * np.cos(θ_5) - s_y * np.sin(θ_5)
    r_y = s_x * np.sin(θ_5) + s_y * np.cos(θ_5)
    g_c = σ_x * (x_5 + r_x - x_g) + W_T / 2 + c_T
    δ = -g_c
    dδ = -σ_x * (dx_5 - ω_5 * r_y)
    v_t = dy_5 + ω_5 * r_x
    return δ, dδ, v_t, r_x, r_y


@formula(r"v_i = \max(\dot\delta(t_i), v_{\min})")
def impact_speed(dδ, v_min):
    return max(dδ, v_min)


@formula(r"K\delta^n")
def point_elastic(K, δ, n):
    return K * max(δ, 0) ** n


@formula(
    r"K_s \delta_1^2 (2\delta_1 - 3\delta_2)/(6(\delta_1 - \delta_2)^2)",
    r"K_s \delta_1^3/(6(\delta_1 - \delta_2)^2)",
    r"K_s \delta_1^3/(6(\delta_1 - \delta_2))",
    r"\delta_2 \le 0 < \delta_1",
)
def triangle(K_s, δ_1, δ_2):
    f_1 = K_s * δ_1**2 * (2 * δ_1 - 3 * δ_2) / (6 * (δ_1 - δ_2) ** 2)
    f_2 = K_s * δ_1**3 / (6 * (δ_1 - δ_2) ** 2)
    U = K_s * δ_1**3 / (6 * (δ_1 - δ_2))
    return np.array([f_1, f_2, U])


@formula(
    r"K_s(2\delta_1 + \delta_2)/6",
    r"K_s(\delta_1 + 2\delta_2)/6",
    r"\frac{K_s}{6}(\delta_1^2 + \delta_1\delta_2 + \delta_2^2)",
)
def trapezoid(K_s, δ_1, δ_2):
    f_1 = K_s * (2 * δ_1 + δ_2) / 6
    f_2 = K_s * (δ_1 + 2 * δ_2) / 6
    U = K_s / 6 * (δ_1**2 + δ_1 * δ_2 + δ_2**2)
    return np.array([f_1, f_2, U])


@formula(
    r"s = f_1/(f_1 + f_2)",
    r"\dot\delta = s\,\dot\delta_1 + (1 - s)\,\dot\delta_2, \qquad v_t = s\,v_{t1} + (1 - s)\,v_{t2}",
)
def side_motion(f_1, f_2, dδ_1, dδ_2, v_t1, v_t2):
    s = f_1 / (f_1 + f_2)
    dδ = s * dδ_1 + (1 - s) * dδ_2
    v_t = s * v_t1 + (1 - s) * v_t2
    return s, dδ, v_t


@formula(
    r"F_n = (f_1 + f_2) \left(1 + C\,\frac{\dot\delta}{v_i}\right)",
    r"\text{ if that is positive, else } 0",
)
def side_force(f_1, f_2, C, dδ, v_i):
    F_n = (f_1 + f_2) * (1 + C * dδ / v_i)
    return max(F_n, 0)


@formula(
    r"F_n = K \delta^n \left(1 + C\,\frac{\dot\delta}{v_i}\right)",
    r"\text{ if that is positive and } \delta > 0, \text{ else } 0",
)
def normal_force(f_1, C, δ, dδ, v_i):
    F_n = f_1 * (1 + C * dδ / v_i)
    return max(F_n, 0) if δ > 0 else 0.0


@formula(
    r"F_n = k \delta^n + c(\delta)\,\dot\delta \text{ if that is positive and } \delta > 0, \text{ else } 0",
    r"c(\delta) = c_{\max}\, s^2 (3 - 2 s), \qquad s = \min(\delta/d_{\max}, 1)",
)
def impact_force(k, n, c_max, d_max, δ, dδ):
    s = min(max(δ, 0) / d_max, 1)
    F_n = k * max(δ, 0) ** n + c_max * s**2 * (3 - 2 * s) * dδ
    return max(F_n, 0) if δ > 0 else 0.0


@formula(
    r"F_t = -c_f\,c_d\,F_n \mathrm{sgn}(v_t)",
    r"c_d = \min\left(1, \max\left(0, \frac{\lvert v_t \rvert - v_0}{v_1 - v_0}\right)\right)",
)
def friction(c_f, v_0, v_1, F_n, v_t):
    c_d = min(1, max(0, (abs(v_t) - v_0) / (v_1 - v_0)))
    return -c_f * c_d * F_n * math.copysign(1, v_t)


@formula(r"F_x = \sigma_x F_n, \qquad F_y = F_t, \qquad M_5 = r_x F_t - r_y \sigma_x F_n")
def corner_load(σ_x, F_n, F_t, r_x, r_y):
    F_x, F_y, M_5 = σ_x * F_n, F_t, r_x * F_t - r_y * σ_x * F_n
    return np.array([F_x, F_y, M_5])


@formula(
    r"e = A - A', \qquad n = e/\lVert e \rVert, \qquad t = (-n_y, n_x), \qquad \delta = \lVert e \rVert - c",
    r"\dot\delta = n \cdot \dot e",
    r"v_t = t \cdot \dot e + \omega (R_b - \lVert e \rVert) - \omega_2 R_b",
    r"P = A' + R_b n",
)
def journal_motion(A, A_, de, c, R_b, ω, ω_2):
    e = A - A_
    n = e / np.linalg.norm(e) if e.any() else np.array([1.0, 0.0])
    t = np.array([-n[1], n[0]])
    δ = np.linalg.norm(e) - c
    dδ = n @ de
    v_t = t @ de + ω * (R_b - np.linalg.norm(e)) - ω_2 * R_b
    P = A_ + R_b * n
    return δ, dδ, v_t, n, t, P


@formula(r"G = F_n\,n - F_t\,t")
def journal_load(F_n, F_t, n, t):
    return F_n * n - F_t * t


@formula(r"P_1 (h/h_1)^q", r"P_1 h_1 (h/h_1)^{q+1}/(q+1)")
def power_load(P_1, h_1, q, h):
    P = P_1 * (h / h_1) ** q
    V = P_1 * h_1 * (h / h_1) ** (q + 1) / (q + 1)
    return P, V


def partners(number):
    return (number["slider"], number["guide"]) if isinstance(number, dict) else (number, number)


class Numbers:
    """The numbers of a scene's contacts, by the keys that the page names."""

    def __init__(self, scene):
        contact, rub, slider = scene["contact"], scene["friction"], scene["mechanism"]["slider"]
        σ_s, σ_g = compliances(*partners(contact["youngs_modulus"]), *partners(contact["poisson"]))
        self.law = contact["law"]
        if self.law not in ("hertz-corners", "paper-switching", "foundation", "adams-impact"):
            raise ValueError(f"{self.law}: enter the page's formulas in `point` or `side`")
        self.n, self.v_min = contact["exponent"], contact["impact_speed_floor"]
        self.K = point_stiffness(σ_s, σ_g, contact["corner_radius"])
        self.K_s = side_stiffness(σ_s, σ_g, slider["thickness"], slider["length"])
        self.C = DAMPING[contact["damping_model"]](contact["restitution"])
        self.c_max, self.d_max = contact["damping"], contact["damping_depth"]
        self.rub = rub["coefficient"], rub["static_speed"], rub["transition_speed"]
        self.W_T, self.c_T = slider["width"], scene["clearance"]["slider"]
        self.corners = [
            (x * slider["width"] / 2, y * slider["length"] / 2, -x) for y in (-1, 1) for x in (-1, 1)
        ]
        self.x_g = scene["mechanism"]["guide_x"]
        self.c = scene["clearance"]["crank_pin"]
        self.R_j = scene["clearance"]["journal_radius"]
        self.K_j = point_stiffness(σ_g, σ_g, conformal_radius(self.R_j, self.c))
        if self.law == "adams-impact" and contact.get("stiffness"):
            self.K = self.K_j = contact["stiffness"]
        self.load = scene["load"]

    def corner(self, k, x_5, θ_5, dx_5, dy_5, ω_5):
        """Depth (m), its rate, slip (m/s) and arm (m) of a corner."""
        s_x, s_y, σ_x = self.corners[k]
        return corner_motion(s_x, s_y, σ_x, self.x_g, self.W_T, self.c_T, x_5, θ_5, dx_5, dy_5, ω_5)

    def point(self, K, δ, dδ, v_t, v_i):
        """F_n, F_t and elastic force (N) of a contact by itself that touched at v_i, and its energy, J."""
        f = point_elastic(K, δ, self.n)
        F_n = (
            impact_force(K, self.n, self.c_max, self.d_max, δ, dδ)
            if self.law == "adams-impact"
            else normal_force(f, self.C, δ, dδ, v_i)
        )
        return [F_n, friction(*self.rub, F_n, v_t), f], f * max(δ, 0) / (self.n + 1)

    def side(self, first, second, v_i):
        """F_n, F_t, elastic force, energy of a side's corners by `corner`; the first is as deep or deeper."""
        (δ_1, dδ_1, v_t1), (δ_2, dδ_2, v_t2) = first[:3], second[:3]
        both = v_i.all() and δ_2 > 0
        if self.law == "paper-switching" and both:
            f_1, f_2, U = trapezoid(self.K_s, δ_1, δ_2)
            return [[f, friction(*self.rub, f, v_t), f] for f, v_t in ((f_1, v_t1), (f_2, v_t2))], U
        if self.law == "foundation" and v_i.any() and δ_1 > 0:
            f_1, f_2, U = (trapezoid if δ_2 > 0 else triangle)(self.K_s, δ_1, δ_2)
            s, dδ, v_t = side_motion(f_1, f_2, dδ_1, dδ_2, v_t1, v_t2)
            F_n = side_force(f_1, f_2, self.C, dδ, v_i.max())
            F_t = friction(*self.rub, F_n, v_t)
            return [[s * F_n, s * F_t, f_1], [(1 - s) * F_n, (1 - s) * F_t, f_2]], U
        points = [
            self.point(self.K, *motion[:3], v) if v else ([0.0] * 3, 0.0)
            for motion, v in zip((first, second), v_i, strict=True)
        ]
        return [state for state, _ in points], sum(U for _, U in points)

    def slider(self, motions, v_i):
        """F_n, F_t and elastic force (4, 3) of the corners, v_i = 0: open, and the energy that they store."""
        states, energy = np.zeros((4, 3)), 0.0
        for low in (0, 1):
            pair = sorted((low, low + 2), key=lambda k: -motions[k][0])
            states[pair], U = self.side(*(motions[k] for k in pair), v_i[pair])
            energy += U
        return states, energy

    def workpiece(self, y_5):
        """Force of the workpiece and its stored energy at a height of the slider, N and J."""
        h = max(self.load["surface"] - y_5, 0)
        if not self.load["table"]:
            return power_load(self.load["force"], self.load["depth"], self.load["exponent"], h)
        h_k, P_k = np.transpose(self.load["table"])
        rows = np.append(h_k[h_k < h], h)
        return np.interp(h, h_k, P_k), np.trapezoid(np.interp(rows, h_k, P_k), rows)
