"""The engine of a reader of docs/model.md: the 15 coordinates of Eq. 20, with no code of either model."""

import math

import numpy as np
from page_formulas import (
    CORNERS,
    Numbers,
    corner_load,
    impact_speed,
    journal_load,
    journal_motion,
)
from scipy.integrate import solve_ivp


def cross(p, q):
    return p[0] * q[1] - p[1] * q[0]


def direction(θ):
    return np.array([math.cos(θ), math.sin(θ)])


def across(u):
    return np.array([-u[1], u[0]])


def at_time(scene, time, x=None, angle=0.0, vx=0.0, omega=0.0):
    """Return the engine whose start is at a time (s), a slider with clearance at x (m, fixed frame)."""
    m, degrees = scene["mechanism"], 6.0 * scene["drive"]["speed_rpm"] * time
    changes = {"mechanism": m | {"crank_angle_deg": m["crank_angle_deg"] + degrees}}
    if x is not None:
        start = {
            "slider_offset": x - m["guide_x"],
            "slider_angle": angle,
            "slider_vx": vx,
            "slider_omega": omega,
        }
        changes["initial"] = start
    return Engine(scene | changes)


class Engine:
    """The press as the page describes it, in 15 coordinates without Baumgarte's terms.

    Behind coordinates and velocities its state has the work of the drive and the losses by damping and by
    friction, J.
    """

    def __init__(self, scene):
        m, self.scene, self.numbers = scene["mechanism"], scene, Numbers(scene)
        bodies = [m[name] for name in ("crank", "rod2", "rocker", "rod4", "slider")]
        self.L, self.Ls = ([rod[key] for rod in bodies[:4]] for key in ("length", "centroid"))
        self.masses = np.array([body["mass"] for body in bodies])
        self.M = np.array([body[key] for body in bodies for key in ("mass", "mass", "inertia")])
        self.J, self.H, self.g = self.M[2::3], np.array(m["rocker_pivot"]), scene["environment"]["gravity"]
        self.ω, self.θ_0 = scene["drive"]["speed_rpm"] * 2 * math.pi / 60, math.radians(m["crank_angle_deg"])
        self.line = m["guide_x"] + m["reference_offset"]
        self.ideal_slider = scene["joints"]["slider"] == "ideal"
        self.ideal_pin = scene["joints"]["crank_pin"] == "ideal"
        # Joint: bodies i and j (None: the frame), and the factors of u_i and u_j in its rows.
        Ls, tip = self.Ls, [length - centroid for length, centroid in zip(self.L, self.Ls, strict=True)]
        self.joints = {"O": (0, None, Ls[0], 0.0)} | ({"A": (1, 0, Ls[1], tip[0])} if self.ideal_pin else {})
        self.joints |= {"H": (2, None, Ls[2], 0.0), "B": (2, 1, 0.0, tip[1])}
        self.joints |= {"C": (3, 2, Ls[3], tip[2]), "F": (4, 3, 0.0, tip[3])}
        self.to_tip = tip
        self.v_i = np.zeros(5)  # corners and journal; 0: open

    def start(self):
        """Return the state at the start, by section 2."""
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
        angles = [self.θ_0, *(math.atan2(u[1], u[0]) for u in (u2, u3, u4)), θ5]
        vA, F, vF = ω * L[0] * n1, C + L[3] * u4, vC + ω4 * L[3] * n4
        centres = [Ls[0] * u1, A + Ls[1] * u2, B, C + Ls[3] * u4, F]
        rates = [ω * Ls[0] * n1, vA + ω2 * Ls[1] * n2, ω3 * Ls[2] * n3, vC + ω4 * Ls[3] * n4, vF]
        q, v = np.column_stack([centres, angles]), np.column_stack([rates, [ω, ω2, ω3, ω4, ω5]])
        return np.array([*q.ravel(), *v.ravel(), 0.0, 0.0, 0.0])

    def constraints(self, q, v):
        """Φ_q and γ of section 3."""
        size = 2 * len(self.joints)
        fixtures = (2, 12, 14) if self.ideal_slider else (2,)
        rows, γ = np.zeros((size + len(fixtures), 15)), np.zeros(size + len(fixtures))
        u = np.column_stack([np.cos(q[2::3]), np.sin(q[2::3])])
        for row, (i, j, arm_i, arm_j) in zip(range(0, size, 2), self.joints.values(), strict=True):
            for body, sign, arm in ((i, 1, arm_i), (j, -1, arm_j)):
                if body is not None:
                    rows[row, 3 * body] = rows[row + 1, 3 * body + 1] = sign
                    rows[row : row + 2, 3 * body + 2] = -arm * across(u[body])
                    γ[row : row + 2] -= arm * u[body] * v[3 * body + 2] ** 2
        rows[range(size, len(rows)), fixtures] = 1.0
        return rows, γ

    def contacts(self, q, v):
        """Depth, its rate, slip and the place of the force for each contact; None for one that is missing."""
        motion = q[12], q[14], *v[12:]
        motions = [None if self.ideal_slider else self.numbers.corner(k, *motion) for k in range(4)] + [None]
        if not self.ideal_pin:
            arm1, arm2 = self.to_tip[0] * direction(q[2]), -self.Ls[1] * direction(q[5])
            A, A_ = q[0:2] + arm1, q[3:5] + arm2
            vA, vA_ = v[0:2] + v[2] * across(arm1), v[3:5] + v[5] * across(arm2)
            R_b = self.numbers.R_j + self.numbers.c
            motions[4] = journal_motion(A, A_, vA - vA_, self.numbers.c, R_b, v[2], v[5])
        return motions

    def forces(self, q, v):
        """Return Q; F_n, F_t, elastic force of each contact, and the energy that they store; `contacts`."""
        Q, motions, numbers = np.zeros(15), self.contacts(q, v), self.numbers
        Q[1::3] = -self.masses * self.g
        Q[13] += numbers.workpiece(q[13])[0]
        states, energy = np.zeros((5, 3)), 0.0
        if not self.ideal_slider:
            states[:4], energy = numbers.slider(motions, self.v_i[:4])
            for k in range(4):
                Q[12:] += corner_load(numbers.corners[k][2], *states[k, :2], *motions[k][3:])
        if self.v_i[4]:
            δ, dδ, v_t, n, t, P = motions[4]
            states[4], U = numbers.point(numbers.K_j, δ, dδ, v_t, self.v_i[4])
            energy += U
            G = journal_load(*states[4, :2], n, t)
            Q[3:6] += [*G, cross(P - q[3:5], G)]
            Q[0:3] -= [*G, cross(P - q[0:2], G)]
        return Q, states, energy, motions

    def solve(self, y):
        """Accelerations and λ of Eq. 20."""
        q, v = y[:15], y[15:30]
        Φ_q, γ = self.constraints(q, v)
        Q, *contacts = self.forces(q, v)
        size = 15 + len(γ)
        matrix = np.zeros((size, size))
        matrix[:15, :15], matrix[:15, 15:], matrix[15:, :15] = np.diag(self.M), Φ_q.T, Φ_q
        solution = np.linalg.solve(matrix, np.concatenate([Q, γ]))
        return solution[:15], solution[15:], *contacts

    def rates(self, _, y):
        a, λ, states, _, motions = self.solve(y)
        indices = np.flatnonzero(self.v_i)
        damping = sum((states[k][0] - states[k][2]) * motions[k][1] for k in indices)
        friction = -sum(states[k][1] * motions[k][2] for k in indices)
        return np.concatenate([y[15:30], a, [-λ[2 * len(self.joints)] * self.ω, damping, friction]])

    def gap(self, k, y):
        return -self.contacts(y[:15], y[15:30])[k][0]

    def height(self, y):
        return self.g * self.masses @ y[1:15:3]

    def channels(self, y, start):
        a, λ, states, energy, motions = self.solve(y)
        q, v = y[:15], y[15:30]
        names = ("x", "y", "angle", "vx", "vy", "omega", "ax", "ay", "alpha")
        out = {f"slider_{n}": value for n, value in zip(names, [*q[12:], *v[12:], *a[12:]], strict=True)}
        if self.ideal_slider:
            out |= {"guide_force": -λ[-2], "guide_moment": -λ[-1]}
        else:
            for k, name in enumerate(CORNERS):
                out[f"corner_{name}_gap"] = -motions[k][0]
                out[f"corner_{name}_normal"], out[f"corner_{name}_friction"] = states[k][:2]
        for joint, name in enumerate(self.joints):
            out[f"reaction_{name}_x"], out[f"reaction_{name}_y"] = -λ[2 * joint], -λ[2 * joint + 1]
        if not self.ideal_pin:
            arms = self.to_tip[0] * direction(q[2]) + self.Ls[1] * direction(q[5])
            out["journal_x"], out["journal_y"] = q[0:2] - q[3:5] + arms
            n, t = motions[4][3:5] if self.v_i[4] else (np.zeros(2), np.zeros(2))
            out["reaction_A_x"], out["reaction_A_y"] = journal_load(states[4][0], states[4][1], n, t)
        out["crank_torque"] = -λ[2 * len(self.joints)]
        kinetic, load = 0.5 * self.M @ v**2, self.numbers.workpiece(q[13])[1]
        parts = y[30], self.height(start) - self.height(y), kinetic, energy, load, y[31], y[32]
        names = ("drive", "gravity", "kinetic", "contact", "load", "damping", "friction")
        return out | {f"energy_{name}": part for name, part in zip(names, parts, strict=True)}

    def run(self, times):
        """Channels at these times, s, and the contacts' table: corner, start, end, impact speed."""
        y, t, table, starts = self.start(), 0.0, [], {}
        start = y
        samples, indices = [], [k for k, motions in enumerate(self.contacts(y[:15], y[15:30])) if motions]
        while t < times[-1]:
            events = []
            for k in indices:
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
            for k in indices:
                gap, rate = self.gap(k, y), -self.contacts(y[:15], y[15:30])[k][1]
                # Two corners may touch at one instant, up to rounding.
                if not self.v_i[k] and rate < 0.0 and gap < 1e-15:
                    self.v_i[k] = impact_speed(-rate, self.numbers.v_min)
                    starts[k] = t
                elif self.v_i[k] and rate > 0.0 and gap > -1e-15:
                    table.append(((*CORNERS, "pin")[k], starts.pop(k), t, self.v_i[k]))
                    self.v_i[k] = 0.0
        return {name: np.array([sample[name] for sample in samples]) for name in samples[0]}, table
