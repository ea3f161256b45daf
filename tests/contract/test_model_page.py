"""docs/model.md is enough to write an engine: its formulas alone give forces and motion of both models.

Each function marked `stated` holds formulas of the page in plain Python, with the page's symbols; the tests
require that formulas and symbols stand on the page. `Engine` is the engine of a reader of the page: the 15
coordinates of Eq. 20, with none of the code of either model.
"""

import ast
import inspect
import math
import re
import textwrap
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from comparison.scene import load_scene
from comparison.tables.channels import channels

PAGE = (Path(__file__).parents[2] / "docs" / "model.md").read_text("utf-8")
MATH = [
    " ".join(re.sub(r"```math|```|\$", "", found).split())
    for found in re.findall(r"```math\n.*?```|\$[^$]+\$", PAGE, re.DOTALL)
]
CORNERS = ("ll", "lr", "ul", "ur")
STATED = []

# Names in the functions below, as the page writes them. "d" before a name is a rate.
SYMBOLS = {
    "E": r"E", "ν": r"\nu", "σ": r"\sigma", "R": r"R", "K": r"K", "n": r"n", "c_e": r"c_e", "C": r"C",
    "T": r"T", "L": r"L", "a": r"a", "K_s": r"K_s", "h": r"h", "δ": r"\delta", "dδ": r"\dot\delta",
    "δ_1": r"\delta_1", "δ_2": r"\delta_2", "f_1": r"f_1", "v_i": r"v_i", "v_min": r"v_{\min}", "F_n": r"F_n",
    "F_t": r"F_t", "c_f": r"c_f", "c_d": r"c_d", "v_t": r"v_t", "v_0": r"v_0", "v_1": r"v_1", "s_x": r"s_x",
    "s_y": r"s_y", "σ_x": r"\sigma_x", "W_T": r"W_T", "c_T": r"c_T", "x_g": r"x_g", "r_x": r"r_x",
    "r_y": r"r_y", "g_c": r"g_c", "x_5": r"x_5", "dx_5": r"\dot x_5", "dy_5": r"\dot y_5", "θ_5": r"\theta_5",
    "ω_5": r"\omega_5", "F_x": r"F_x", "F_y": r"F_y", "M_5": r"M_5", "A": r"A", "A_": r"A'", "e": r"e",
    "de": r"\dot e", "t": r"t", "c": r"c", "R_j": r"R_j", "R_b": r"R_b", "ω": r"\omega", "ω_2": r"\omega_2",
    "P": r"P", "G": r"G",
}  # fmt: skip


def stated(*formulas):
    """Mark a function as these formulas of the page."""

    def mark(function):
        STATED.append((function, formulas))
        return function

    return mark


@stated(r"\sigma = \frac{1 - \nu^2}{E}", r"K = \frac{4}{3 (\sigma + \sigma)} \sqrt{R}")
def point_stiffness(E, ν, R):
    σ = (1 - ν**2) / E
    return 4 / (3 * (σ + σ)) * math.sqrt(R)


@stated(r"K_s = \frac{a}{0.475 (\sigma + \sigma)}", r"a = T + L")
def side_stiffness(E, ν, T, L):
    σ = (1 - ν**2) / E
    a = T + L
    return a / (0.475 * (σ + σ))


@stated(r"C = \frac{3}{4} (1 - c_e^2)")
def damping(c_e):
    return 3 / 4 * (1 - c_e**2)


@stated(r"R_j R_b/(R_b - R_j)", r"R_b = R_j + c")
def conformal_radius(R_j, c):
    R_b = R_j + c
    return R_j * R_b / (R_b - R_j)


@stated(
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


@stated(r"v_i = \max(\dot\delta(t_i), v_{\min})")
def impact_speed(dδ, v_min):
    return max(dδ, v_min)


@stated(r"K\delta^n")
def point_elastic(K, δ, n):
    return K * np.maximum(δ, 0) ** n


@stated(r"K_s(2\delta_1 + \delta_2)/6")
def surface_elastic(K_s, δ_1, δ_2):
    return K_s * (2 * δ_1 + δ_2) / 6


@stated(
    r"K\delta_1^n + 4 K_s h (\delta_2/(\delta_1 + \delta_2))^2",
    r"h = \frac{\delta_1 \delta_2}{\delta_1 + \delta_2}",
)
def strip_elastic(K, K_s, n, δ_1, δ_2):
    h = δ_1 * δ_2 / (δ_1 + δ_2)
    return K * δ_1**n + 4 * K_s * h * (δ_2 / (δ_1 + δ_2)) ** 2


@stated(
    r"F_n = K \delta^n \left(1 + C\,\frac{\dot\delta}{v_i}\right)",
    r"\text{ if that is positive and } \delta > 0, \text{ else } 0",
)
def normal_force(f_1, C, δ, dδ, v_i):
    F_n = f_1 * (1 + C * dδ / v_i)
    return np.where((F_n > 0) & (δ > 0), F_n, 0)


@stated(
    r"F_t = -c_f\,c_d\,F_n \mathrm{sgn}(v_t)",
    r"c_d = \min\left(1, \max\left(0, \frac{\lvert v_t \rvert - v_0}{v_1 - v_0}\right)\right)",
)
def friction(c_f, v_0, v_1, F_n, v_t):
    c_d = np.minimum(1, np.maximum(0, (np.abs(v_t) - v_0) / (v_1 - v_0)))
    return -c_f * c_d * F_n * np.sign(v_t)


@stated(r"F_x = \sigma_x F_n, \qquad F_y = F_t, \qquad M_5 = r_x F_t - r_y \sigma_x F_n")
def corner_load(σ_x, F_n, F_t, r_x, r_y):
    F_x, F_y, M_5 = σ_x * F_n, F_t, r_x * F_t - r_y * σ_x * F_n
    return np.array([F_x, F_y, M_5])


@stated(
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


@stated(r"G = F_n\,n - F_t\,t")
def journal_load(F_n, F_t, n, t):
    return F_n * n - F_t * t


@pytest.mark.parametrize(("function", "formulas"), STATED, ids=lambda value: getattr(value, "__name__", ""))
def test_every_formula_and_symbol_of_these_functions_is_on_the_page(function, formulas) -> None:
    for formula in formulas:
        assert any(formula in math for math in MATH), formula
    tree = ast.parse(textwrap.dedent(inspect.getsource(function)))
    # Of the formulas, not of the decorator.
    tree.body[0].decorator_list.clear()
    names = {node.id for node in ast.walk(tree) if isinstance(node, ast.Name)}
    names |= {node.arg for node in ast.walk(tree) if isinstance(node, ast.arg)}
    for name in names - {"np", "math", "max"}:
        symbol = re.escape(SYMBOLS[name])
        assert any(re.search(rf"(?<![A-Za-z\\]){symbol}(?![A-Za-z_'])", math) for math in MATH), name


class Numbers:
    """The numbers of a scene's contacts, by the keys that the page names."""

    def __init__(self, scene) -> None:
        contact, rub, slider = scene["contact"], scene["friction"], scene["mechanism"]["slider"]
        material = contact["youngs_modulus"], contact["poisson"]
        self.law = contact["law"]
        self.n, self.v_min = contact["exponent"], contact["impact_speed_floor"]
        self.K = point_stiffness(*material, contact["corner_radius"])
        self.K_s = side_stiffness(*material, slider["thickness"], slider["length"])
        self.C = damping(contact["restitution"])
        self.rub = rub["coefficient"], rub["static_speed"], rub["transition_speed"]
        self.W_T, self.c_T = slider["width"], scene["clearance"]["slider"]
        self.corners = [
            (x * slider["width"] / 2, y * slider["length"] / 2, -x) for y in (-1, 1) for x in (-1, 1)
        ]
        self.x_g = scene["mechanism"]["guide_x"]
        self.c = scene["clearance"]["crank_pin"]
        self.R_j = scene["clearance"]["journal_radius"]
        self.K_j = point_stiffness(*material, conformal_radius(self.R_j, self.c))

    def corner(self, k: int, x_5, θ_5, dx_5, dy_5, ω_5):
        """Depth (m), its rate, slip (m/s) and arm (m) of a corner."""
        s_x, s_y, σ_x = self.corners[k]
        return corner_motion(s_x, s_y, σ_x, self.x_g, self.W_T, self.c_T, x_5, θ_5, dx_5, dy_5, ω_5)

    def elastic(self, δ_1, δ_2):
        """Force of a corner of depth δ_1 before damping, N; δ_2 is that of the other corner of its side."""
        alone = point_elastic(self.K, δ_1, self.n)
        both = (δ_1 > 0) & (δ_2 > 0)
        if self.law == "hertz-corners" or not np.any(both):
            return alone
        d_1, d_2 = np.where(both, δ_1, 1), np.where(both, δ_2, 1)
        if self.law == "strip":
            return np.where(both, strip_elastic(self.K, self.K_s, self.n, d_1, d_2), alone)
        return np.where(both, surface_elastic(self.K_s, d_1, d_2), alone)

    def normal(self, δ_1, δ_2, dδ, v_i):
        """Force of such a corner that touched at v_i, N."""
        elastic = self.elastic(δ_1, δ_2)
        damped = normal_force(elastic, self.C, δ_1, dδ, v_i)
        return np.where((δ_1 > 0) & (δ_2 > 0), elastic, damped) if self.law == "paper-switching" else damped


# Contacts that exist at t = 0: all that their forces need follows from channels and scene alone. A side is
# pressed in with both corners, a little tilted, and begins to slip on the ramp of the friction; 80 us.
SIDE = {
    "initial.slider_offset": 2.02e-4,
    "initial.slider_angle": 1e-5,
    "initial.slider_vx": 2e-3,
    "drive.cycles": 2e-4,
    "output.samples_per_cycle": 10_000_000,
}
CASES = {
    "opposite corners": ("wedge", {}),
    "one side, hertz-corners": ("150rpm-0.2mm", SIDE),
    "one side, strip": ("150rpm-0.2mm", {**SIDE, "contact.law": "strip"}),
    "one side, paper-switching": ("150rpm-0.2mm", {**SIDE, "contact.law": "paper-switching"}),
}


@pytest.mark.parametrize("variant", ["reference-minimal", "exudyn-tree"])
@pytest.mark.parametrize("case", CASES)
def test_the_page_gives_the_force_of_every_corner_from_the_slider_s_motion(run, variant, case) -> None:
    found = run(variant, *CASES[case])
    numbers, columns = Numbers(found.scene), found.columns
    motion = [columns[f"slider_{name}"] for name in ("x", "angle", "vx", "vy", "omega")]
    corners = [numbers.corner(k, *motion) for k in range(4)]
    _, v_0, v_1 = numbers.rub
    pressed = ramp = 0
    for k, name in enumerate(CORNERS):
        δ_1, dδ, v_t, *_ = corners[k]
        δ_2 = corners[k ^ 2][0]
        # A gap is a difference of coordinates of 0.55 m: some rounding errors of 1e-16 m.
        assert np.abs(columns[f"corner_{name}_gap"] + δ_1).max() <= 5e-16
        if δ_1[0] <= 0.0:
            continue
        contact = found.contacts(name)[0]
        v_i = impact_speed(dδ[0], numbers.v_min)
        assert contact["start"] == 0.0
        assert contact["normal_speed"] == pytest.approx(v_i, rel=1e-14)
        during = columns["time"] < contact["end"]  # later ones have impact speeds of their own
        F_n = numbers.normal(δ_1, δ_2, dδ, v_i)[during]
        F_t = friction(*numbers.rub, F_n, v_t[during])
        # The rounding of the depths, times the slope of the elastic force and the damping factor, below 4; of
        # sums and products 1e-12.
        reach = [numbers.elastic(δ_1 + i, δ_2 + j) for i in (0.0, 5e-16) for j in (0.0, 5e-16)]
        bound = 4.0 * (np.max(reach, axis=0) - reach[0])[during] + 1e-12 * F_n + 1e-12
        assert np.all(np.abs(columns[f"corner_{name}_normal"][during] - F_n) <= bound)
        assert np.all(np.abs(columns[f"corner_{name}_friction"][during] - F_t) <= bound)
        slip = np.abs(v_t[during])
        pressed += np.count_nonzero(F_n)
        ramp += np.count_nonzero((F_n > 0.0) & (v_0 < slip) & (slip < v_1))
    assert pressed > 30
    assert ramp >= 2


def cross(p, q):
    return p[0] * q[1] - p[1] * q[0]


def direction(θ):
    return np.array([math.cos(θ), math.sin(θ)])


def across(u):
    return np.array([-u[1], u[0]])


class Engine:
    """The press as the page describes it, in 15 coordinates without Baumgarte's terms.

    Behind coordinates and velocities its state has the work of the drive and the losses by damping and by
    friction, J.
    """

    def __init__(self, scene) -> None:
        m, self.scene, self.numbers = scene["mechanism"], scene, Numbers(scene)
        rods = [m[name] for name in ("crank", "rod2", "rocker", "rod4")]
        self.L = [rod["length"] for rod in rods]
        self.Ls = [rod["centroid"] for rod in rods]
        bodies = [*rods, m["slider"]]
        self.masses = np.array([body["mass"] for body in bodies])
        self.M = np.array([body[key] for body in bodies for key in ("mass", "mass", "inertia")])
        self.J, self.H, self.g = self.M[2::3], np.array(m["rocker_pivot"]), scene["environment"]["gravity"]
        self.ω, self.θ_0 = scene["drive"]["speed_rpm"] * 2 * math.pi / 60, math.radians(m["crank_angle_deg"])
        self.line = m["guide_x"] + m["reference_offset"]
        self.ideal_slider = scene["joints"]["slider"] == "ideal"
        self.ideal_pin = scene["joints"]["crank_pin"] == "ideal"
        # Joint: bodies i and j (None: the frame), and what stands before u_i and u_j in its rows.
        to_tip = [length - centroid for length, centroid in zip(self.L, self.Ls, strict=True)]
        self.joints = {
            "O": (0, None, self.Ls[0], 0.0),
            "A": (1, 0, self.Ls[1], to_tip[0]),
            "H": (2, None, self.Ls[2], 0.0),
            "B": (2, 1, 0.0, to_tip[1]),
            "C": (3, 2, self.Ls[3], to_tip[2]),
            "F": (4, 3, 0.0, to_tip[3]),
        }
        if not self.ideal_pin:
            del self.joints["A"]
        self.to_tip = to_tip
        self.v_i = np.zeros(5)  # corners and journal; 0: open

    def start(self):
        """Section 2."""
        m, initial = self.scene["mechanism"], self.scene["initial"]
        L, Ls, H, ω = self.L, self.Ls, self.H, self.ω
        u1 = direction(self.θ_0)
        A = L[0] * u1
        d = np.linalg.norm(H - A)
        e = (H - A) / d
        p = (d**2 + L[1] ** 2 - Ls[2] ** 2) / (2 * d)
        B = A + p * e + m["rocker_branch"] * math.sqrt(L[1] ** 2 - p**2) * across(e)
        u2, u3 = (B - A) / L[1], (B - H) / Ls[2]
        C = H + L[2] * u3
        x5, vx5, θ5, ω5 = self.line, 0.0, 0.0, 0.0
        if not self.ideal_slider:
            x5, vx5 = m["guide_x"] + initial["slider_offset"], initial["slider_vx"]
            θ5, ω5 = initial["slider_angle"], initial["slider_omega"]
        c4 = (x5 - C[0]) / L[3]
        u4 = np.array([c4, m["slider_branch"] * math.sqrt(1 - c4**2)])
        n1, n2, n3, n4 = (across(u) for u in (u1, u2, u3, u4))
        ω2 = ω * L[0] * (n1 @ u3) / (L[1] * (n3 @ u2))
        ω3 = ω * L[0] * (n1 @ u2) / (Ls[2] * (n3 @ u2))
        vC = L[2] * ω3 * n3
        ω4 = (vC[0] - vx5) / (L[3] * u4[1])
        centres = [Ls[0] * u1, A + Ls[1] * u2, B, C + Ls[3] * u4, C + L[3] * u4]
        rates = [
            *(ω * Ls[0] * n1, ω * L[0] * n1 + ω2 * Ls[1] * n2, ω3 * Ls[2] * n3),
            *(vC + ω4 * Ls[3] * n4, vC + ω4 * L[3] * n4),
        ]
        angles = [math.atan2(u[1], u[0]) for u in (u1, u2, u3, u4)]
        q = [z for centre, θ in zip(centres, [*angles, θ5], strict=True) for z in (*centre, θ)]
        v = [z for rate, w in zip(rates, [ω, ω2, ω3, ω4, ω5], strict=True) for z in (*rate, w)]
        q[2] = self.θ_0
        return np.array([*q, *v, 0.0, 0.0, 0.0])

    def constraints(self, q, v):
        """Φ_q and γ of section 3."""
        rows, γ = [], []
        for i, j, arm_i, arm_j in self.joints.values():
            for axis in range(2):
                row, right = np.zeros(15), 0.0
                for body, sign, arm in ((i, 1, arm_i), (j, -1, arm_j)):
                    if body is not None:
                        θ, w = q[3 * body + 2], v[3 * body + 2]
                        u = direction(θ)
                        row[3 * body + axis], row[3 * body + 2] = sign, -arm * across(u)[axis]
                        right -= arm * u[axis] * w**2
                rows.append(row)
                γ.append(right)
        for coordinate in (2, 12, 14) if self.ideal_slider else (2,):
            rows.append(np.eye(15)[coordinate])
            γ.append(0.0)
        return np.array(rows), np.array(γ)

    def contacts(self, q, v):
        """Of each contact: depth, its rate, slip, what places its force; None where there is none."""
        found = [None] * 5
        if not self.ideal_slider:
            found[:4] = [self.numbers.corner(k, q[12], q[14], v[12], v[13], v[14]) for k in range(4)]
        if not self.ideal_pin:
            arm1, arm2 = self.to_tip[0] * direction(q[2]), -self.Ls[1] * direction(q[5])
            A, A_ = q[0:2] + arm1, q[3:5] + arm2
            vA, vA_ = v[0:2] + v[2] * across(arm1), v[3:5] + v[5] * across(arm2)
            R_b = self.numbers.R_j + self.numbers.c
            found[4] = journal_motion(A, A_, vA - vA_, self.numbers.c, R_b, v[2], v[5])
        return found

    def forces(self, q, v):
        """Q, and F_n, F_t and the elastic force of each contact."""
        Q, found, numbers = np.zeros(15), self.contacts(q, v), self.numbers
        Q[1::3] = -self.masses * self.g
        states = np.zeros((5, 3))
        for k in np.flatnonzero(self.v_i):
            δ, dδ, v_t, *place = found[k]
            if k < 4:
                other = found[k ^ 2][0] if self.v_i[k ^ 2] > 0.0 else 0.0
                f, F_n = numbers.elastic(δ, other), numbers.normal(δ, other, dδ, self.v_i[k])
            else:
                f = point_elastic(numbers.K_j, δ, numbers.n)
                F_n = normal_force(f, numbers.C, δ, dδ, self.v_i[k])
            F_t = friction(*numbers.rub, F_n, v_t)
            states[k] = F_n, F_t, f
            if k < 4:
                Q[12:] += corner_load(numbers.corners[k][2], F_n, F_t, *place)
            else:
                n, t, P = place
                G = journal_load(F_n, F_t, n, t)
                Q[3:6] += [*G, cross(P - q[3:5], G)]
                Q[0:3] -= [*G, cross(P - q[0:2], G)]
        return Q, states, found

    def solve(self, y):
        """Accelerations and λ of Eq. 20."""
        q, v = y[:15], y[15:30]
        Φ_q, γ = self.constraints(q, v)
        Q, states, found = self.forces(q, v)
        size = 15 + len(γ)
        matrix = np.zeros((size, size))
        matrix[:15, :15], matrix[:15, 15:], matrix[15:, :15] = np.diag(self.M), Φ_q.T, Φ_q
        solution = np.linalg.solve(matrix, np.concatenate([Q, γ]))
        return solution[:15], solution[15:], states, found

    def rates(self, _, y):
        a, λ, states, found = self.solve(y)
        damping = sum((states[k][0] - states[k][2]) * found[k][1] for k in np.flatnonzero(self.v_i))
        rubbing = -sum(states[k][1] * found[k][2] for k in np.flatnonzero(self.v_i))
        return np.concatenate([y[15:30], a, [-λ[2 * len(self.joints)] * self.ω, damping, rubbing]])

    def gap(self, k, y):
        return -self.contacts(y[:15], y[15:30])[k][0]

    def energies(self, y, found):
        """Stored energies of section 8, kinetic and in the contacts, and that of height."""
        q, v, numbers = y[:15], y[15:30], self.numbers
        stored = 0.0
        for k in np.flatnonzero(self.v_i):
            K = numbers.K if k < 4 else numbers.K_j
            stored += K / (numbers.n + 1) * max(found[k][0], 0.0) ** (numbers.n + 1)
        return 0.5 * self.M @ v**2, stored, self.g * self.masses @ q[1::3]

    def channels(self, y, start):
        a, λ, states, found = self.solve(y)
        q, v = y[:15], y[15:30]
        out = dict(
            zip(
                [f"slider_{name}" for name in ("x", "y", "angle", "vx", "vy", "omega", "ax", "ay", "alpha")],
                [*q[12:], *v[12:], *a[12:]],
                strict=True,
            )
        )
        if self.ideal_slider:
            out |= {"guide_force": -λ[-2], "guide_moment": -λ[-1]}
        else:
            for k, name in enumerate(CORNERS):
                parts = -found[k][0], states[k][0], states[k][1]
                out |= {
                    f"corner_{name}_{what}": part
                    for what, part in zip(("gap", "normal", "friction"), parts, strict=True)
                }
        for joint, name in enumerate(self.joints):
            out[f"reaction_{name}_x"], out[f"reaction_{name}_y"] = -λ[2 * joint], -λ[2 * joint + 1]
        if not self.ideal_pin:
            n, t = found[4][3:5] if self.v_i[4] else (np.zeros(2), np.zeros(2))
            out["reaction_A_x"], out["reaction_A_y"] = journal_load(states[4][0], states[4][1], n, t)
        out["crank_torque"] = -λ[2 * len(self.joints)]
        kinetic, contact, height = self.energies(y, found)
        parts = y[30], start[2] - height, kinetic, contact, y[31], y[32]
        names = ("drive", "gravity", "kinetic", "contact", "damping", "friction")
        return out | {f"energy_{name}": part for name, part in zip(names, parts, strict=True)}

    def run(self, times):
        """Channels at these times, s, and the contacts' table: corner, start, end, impact speed."""
        y, t, table, begun = self.start(), 0.0, [], {}
        start = self.energies(y, self.contacts(y[:15], y[15:30]))
        samples, there = [], [k for k, found in enumerate(self.contacts(y[:15], y[15:30])) if found]
        while t < times[-1]:
            events = []
            for k in there:
                event = lambda _, y, k=k: self.gap(k, y)  # noqa: E731
                event.terminal, event.direction = True, 1.0 if self.v_i[k] else -1.0
                events.append(event)
            # Steps that cannot jump over a contact of some 0.1 ms.
            piece = solve_ivp(
                self.rates, (t, times[-1]), y, "DOP853", rtol=1e-12, atol=1e-14, events=events,
                dense_output=True, max_step=2e-5 if self.v_i.any() else 1e-4,
            )  # fmt: skip
            assert piece.success
            samples += [
                self.channels(piece.sol(at), start)
                for at in times[(times >= t) & ((times < piece.t[-1]) | (piece.t[-1] == times[-1]))]
            ]
            t, y = piece.t[-1], piece.y[:, -1]
            if t == times[-1]:
                break
            for k in there:
                gap, rate = self.gap(k, y), -self.contacts(y[:15], y[15:30])[k][1]
                # Two corners may touch at one instant, but for rounding.
                if not self.v_i[k] and rate < 0.0 and gap < 1e-15:
                    self.v_i[k] = impact_speed(-rate, self.numbers.v_min)
                    begun[k] = t
                elif self.v_i[k] and rate > 0.0 and gap > -1e-15:
                    table.append(((*CORNERS, "pin")[k], begun.pop(k), t, self.v_i[k]))
                    self.v_i[k] = 0.0
        return {name: np.array([sample[name] for sample in samples]) for name in samples[0]}, table


MOTIONS = {
    # Two corners of the left side at one instant, 45 and 59 N.
    "150rpm-0.2mm": 0.03,
    # Two bounces of the journal, 305 and 1559 N.
    "crank-pin": 0.0195,
}
# Largest difference of a channel from this engine's, relative to its range; 1.3e-8 is found. The integrators
# keep their errors below 1e-12 (this one) to 1e-10 rad a step, and forces are those of depths of 1e-6 m.
LARGEST = 1e-7


@pytest.fixture(scope="module")
def solution():
    """What the engine gives of a scene at some times, found once."""
    known = {}

    def solve(name, scene, times):
        if name not in known:
            known[name] = Engine(scene).run(times)
        return known[name]

    return solve


@pytest.mark.parametrize("variant", ["reference-minimal", "exudyn-tree"])
@pytest.mark.parametrize("name", MOTIONS)
def test_an_engine_made_from_the_page_gives_what_the_models_give(run, solution, variant, name) -> None:
    """From t = 0 through the first contacts: all channels, impact speeds, starts and ends of contacts."""
    changes = {"drive.cycles": MOTIONS[name], "output.samples_per_cycle": 20_000}
    found = run(variant, name, changes)
    columns, table = solution(name, found.scene, found.columns["time"])
    for channel in found.columns.keys() - {"time", "energy_residual"}:
        values, own = found.columns[channel], columns[channel]
        bound = LARGEST * np.ptp(own) + channels()[channel].floor  # below it nothing happens
        assert np.abs(own - values).max() <= bound, channel
    events = found.result.events
    assert events["start"].size == len(table) == 2
    for contact, start, end, speed in table:
        at = np.argmin(np.abs(events["start"] - start) + (events["corner"] != contact))
        assert events["corner"][at] == contact
        # Found are 5e-13 s: at 0.03 m/s that is 1e-14 m, what the integrators leave of the gap.
        assert events["start"][at] == pytest.approx(start, abs=1e-11)
        assert events["end"][at] == pytest.approx(end, abs=1e-11)
        assert events["normal_speed"][at] == pytest.approx(speed, rel=LARGEST)


def test_the_projections_of_section_4_are_those_of_its_equations() -> None:
    """Accelerations of the 15 coordinates fulfil the rows in the fewest, with every contact force in them."""
    # Two opposite corners in their walls; the journal leaves its clearance of 0.2 mm by the crank's turn.
    scene = load_scene("both-clearances", {"initial.slider_angle": 5.8e-3, "initial.slider_offset": 0.0}).data
    engine = Engine(scene)
    y = engine.start()
    q, v = y[:15], y[15:30]
    q[2] += 5e-3
    q[0:2] = engine.Ls[0] * direction(q[2])
    v[0:2] = engine.Ls[0] * v[2] * across(direction(q[2]))
    v[14] = 0.3
    engine.v_i[[1, 2, 4]] = 0.1
    a, _, states, found = engine.solve(y)
    assert np.all(states[[1, 2, 4], 0] > 0.1)
    F_x, F_y, M_5 = sum(
        corner_load(engine.numbers.corners[k][2], *states[k][:2], *found[k][3:]) for k in range(4)
    )
    n, t, P = found[4][3:]
    G = journal_load(*states[4][:2], n, t)
    (u2, u3, u4), (ω2, ω3, ω4) = (direction(θ) for θ in q[5:12:3]), v[5:12:3]
    n2, n3, n4 = across(u2), across(u3), across(u4)
    (_, m2, m3, m4, m5), (_, J2, J3, J4, J5), (_, L2, L3, L4) = engine.masses, engine.J, engine.L
    (_, Ls2, Ls3, Ls4), g = engine.Ls, engine.g
    b, S4, I4 = L2 - Ls2, m4 * Ls4 + m5 * L4, J4 + m4 * Ls4**2 + m5 * L4**2
    I3, A_ = J3 + (m2 + m3) * Ls3**2 + (m4 + m5) * L3**2, engine.H + Ls3 * u3 - L2 * u2
    weight, F = np.array([0.0, g]), np.array([F_x, F_y])
    f2 = m2 * (Ls3 * ω3**2 * u3 - b * ω2**2 * u2 - weight)
    f4 = F + S4 * ω4**2 * u4 - (m4 + m5) * weight
    coupling = -m2 * b * Ls3 * (n2 @ n3), S4 * L3 * (n3 @ n4)
    rows = np.array([[J2 + m2 * b**2, coupling[0], 0], [coupling[0], I3, coupling[1]], [0, coupling[1], I4]])
    right = [
        -b * n2 @ f2 + cross(P - A_, G) - L2 * n2 @ G,
        Ls3 * n3 @ (f2 + G - m3 * weight) + L3 * n3 @ f4,
        n4 @ (S4 * (L3 * ω3**2 * u3 - weight) + L4 * F),
    ]
    # Rounding of a solution of 27 equations.
    np.testing.assert_allclose(a[5:12:3], np.linalg.solve(rows, right), rtol=1e-10)
    assert a[14] == pytest.approx(M_5 / J5, rel=1e-10)
    ddC = L3 * (a[8] * n3 - ω3**2 * u3)
    assert a[11] == pytest.approx((-S4 * n4 @ (ddC + weight) + L4 * n4 @ F) / I4, rel=1e-10)
