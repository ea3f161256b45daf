"""Random linkage scenes: four-bars, slider-cranks, Watt and Stephenson six-bars, some that pass singular positions.

`scene(kind, i)` is the same at every call. Of five in a row one has lengths of a change point, one is driven into a
dead position by its speed; the others are drawn so that a drive by speed turns freely, and swing as they like without.
"""

import math
import zlib

import numpy as np
from linkage_oracle import Linkage, Lost

KINDS = ("four-bar", "slider-crank", "watt", "stephenson")
CASES = ("change-point", "smooth", "smooth", "dead", "smooth")
# Links that the dyad of a six-bar joins: neighbours of the first loop in Watt's chain, opposite ones in Stephenson's.
HANGS = {
    "watt": (("rod", "rocker"), ("crank", "rod"), ("rocker", "frame"), ("crank", "frame")),
    "stephenson": (("rod", "frame"), ("crank", "rocker")),
}


def scene(kind, i):
    """Return the complete mapping of one random scene."""
    rng = np.random.default_rng([zlib.crc32(kind.encode()), i])
    case = CASES[i % len(CASES)]
    # Drawn evenly: of the smooth ones, speeds in two of five; of change points, every other.
    drive = ("speed", "free", "speed", "torque", "table")[(i // 5 + i) % 5] if case == "smooth" else "speed"
    if case == "change-point" and (i // 5) % 2:
        drive = ("free", "torque", "table")[(i // 10) % 3]
    while True:
        candidate = draw(rng, kind, case, drive)
        if candidate is not None:
            candidate["scene"] = {"name": f"{kind}-{i}", "title": f"{kind} {i}, {case}, {drive}", "description": ""}
            return candidate


def draw(rng, kind, case, drive):
    """Return one candidate, or None where it does not suit its case."""
    slider = kind == "slider-crank"
    lengths = slider_lengths(rng, case) if slider else bar_lengths(rng, case, drive)
    O = complex(*rng.uniform(-0.2, 0.2, 2)) if rng.random() < 0.5 else 0j  # noqa: E741
    gamma, theta = rng.uniform(-math.pi, math.pi, 2)
    a, b = lengths[:2]
    A = O + a * np.exp(1j * theta)
    side = rng.choice([-1, 1])
    if slider:
        along = np.exp(1j * gamma)
        line = O + 1j * along * lengths[2]
        z = (A - line) * np.conj(along)
        if abs(z.imag) > 0.9 * b:
            return None
        B = line + along * (z.real + side * math.sqrt(b * b - z.imag**2))
        sines = [abs(((B - A) * np.conj(along)).real) / b, abs(((A - O) * np.conj(B - A)).imag) / (a * b)]
    else:
        c, d = lengths[2:]
        C = O + d * np.exp(1j * gamma)
        B = corner(A, b, C, c, side)
        if B is None:
            return None
        sines = [abs(((B - A) * np.conj(B - C)).imag) / (b * c), abs(((A - O) * np.conj(B - A)).imag) / (a * b)]
    if min(sines) < 0.35:
        return None

    lines = {"crank": (O, A), "rod": (A, B)} | ({} if slider else {"rocker": (C, B)})
    names = {"crank": "OA", "rod": "AB", "rocker": "CB", "five": "DE", "six": "FE"}
    places = {"O": O, "A": A, "B": B} | ({} if slider else {"C": C})
    joined = {"O": ["frame", "crank"], "A": ["crank", "rod"], "B": ["rod", "slider" if slider else "rocker"]}
    if not slider:
        joined["C"] = ["frame", "rocker"]
    if kind in HANGS:
        for pin, body, hung in zip("DF", HANGS[kind][rng.integers(len(HANGS[kind]))], ("five", "six"), strict=True):
            P, Q = lines.get(body, (O, O + 0.3 * np.exp(1j * gamma)))
            places[pin] = P + (Q - P) * complex(rng.uniform(0.3, 1.3), rng.uniform(-0.6, 0.6))
            joined[pin] = [body, hung]
        D, F = places["D"], places["F"]
        if abs(D - F) < 0.1:
            return None
        tall = rng.uniform(0.25, 0.4) if case == "dead" else rng.uniform(0.5, 1.2)
        places["E"] = D + (F - D) * complex(rng.uniform(0.3, 0.7), tall * rng.choice([-1, 1]))
        joined["E"] = ["five", "six"]
        lines |= {"five": (D, places["E"]), "six": (F, places["E"])}

    bodies, turns = {}, {}
    for body, (P, Q) in lines.items():
        pins = {pin: places[pin] for pin, ends in joined.items() if body in ends}
        bodies[body], turns[body] = link(rng, P, Q, pins, names[body])
    if slider:
        own = complex(*rng.uniform(-0.05, 0.05, 2))
        turns["slider"] = math.degrees(gamma) + rng.choice([0.0, 90.0, rng.uniform(-90, 90)])
        turn = np.exp(1j * math.radians(turns["slider"]))
        bodies["slider"] = {"mass": rng.uniform(0.3, 2), "inertia": rng.uniform(1e-3, 5e-3), "centroid": [0.01, -0.02]}
        # The line is the centroid's; that of B goes through `line`.
        center = line - turn * (own - complex(0.01, -0.02))
        bodies["slider"]["points"] = {"B": pair(own)}
    order = rng.permutation(list(bodies)).tolist()
    bodies = {body: bodies[body] for body in order}

    pins = {}
    for pin, ends in joined.items():
        if ends[0] != "frame" and rng.random() < 0.5:
            ends.reverse()
        pins[pin] = {"joins": [f"{b}.{point(bodies, b, pin)}" if b != "frame" else b for b in sorted(ends, key=lambda b: b != "frame")]}  # fmt: skip
        pins[pin]["point"] = pair(places[pin]) if "frame" in ends else [0.0, 0.0]
    made = {"body": bodies, "pin": pins, "guide": {}, "spring": springs(rng, bodies, places, case)}
    if slider:
        made["guide"]["G"] = {
            "body": "slider", "on": "frame", "point": pair(center + along * rng.uniform(-0.1, 0.1)),
            "direction_deg": math.degrees(gamma), "angle_deg": turns["slider"],
        }  # fmt: skip
    driven = "crank"
    if drive == "speed" and case == "smooth":
        driven = rng.choice(["crank", "crank", "rod"] + ([] if slider else ["rocker"])).item()
    made["drive"] = drive_table(rng, driven, drive)
    made["environment"] = {"gravity": 9.81 if rng.random() < 0.7 else 0.0}
    made["guess"] = {body: {"angle_deg": float(round(turn))} for body, turn in turns.items()}
    made["initial"] = {driven: {"angle_deg": float(turns[driven])}}
    made["compare"] = {}
    if drive == "speed":
        made["drive"]["cycles"] = 1.0
        made["output"] = {"samples_per_cycle": 200}
        step = 60 / abs(made["drive"]["speed_rpm"]) / 20_000
    else:
        made["output"] = {"duration": round(rng.uniform(0.4, 1.0), 1), "samples": 200}
        step = made["output"]["duration"] / 20_000
    made["output"]["groups"] = ["accelerations", "joints", "energy"]
    made["solver"] = {
        "reference": {"formulation": "auto", "method": "dop853", "tolerance": 1e-10},
        "exudyn": {"formulation": "full", "method": "auto", "step": step, "tolerance": 1e-9},
    }
    return finish(rng, made, case, drive)


def finish(rng, made, case, drive):
    """Add what needs the assembled linkage: load, rates, torques; None where the case does not come out."""
    try:
        linkage = Linkage(made)
        frames = linkage.place(linkage.q)
    except Lost:
        return None
    body = rng.choice(["slider" if "slider" in made["body"] else "rocker", "rod"]).item()
    if rng.random() < 0.25:
        load = {"body": body, "surface": linkage.centroid(frames, body).v.imag + rng.uniform(-0.05, 0.02)}
        load |= {"force": rng.uniform(10, 60), "depth": 0.05, "exponent": rng.choice([1.0, 1.5, 2.0]).item(), "table": []}
        if rng.random() < 0.3:
            load |= {"force": 0.0, "table": [[0.0, 0.0], [0.02, rng.uniform(5, 30)], [0.1, rng.uniform(0, 60)]]}
        made["load"] = load
    if drive == "speed":
        lowest = scan(linkage)
        suits = {"smooth": lowest > 0.1, "dead": lowest == 0, "change-point": lowest < 0.1}[case]
        return made if suits else None
    inertia = linkage.equation(frames, 0.0)[0]
    if drive == "torque":
        made["drive"]["torque"] = inertia * rng.uniform(-30, 30)
    if drive == "table":
        inner = np.sort(rng.uniform(20, 340, rng.integers(2, 6))).tolist()
        torques = (inertia * rng.uniform(-40, 40, len(inner) + 1)).tolist()
        made["drive"]["torque_table"] = [list(p) for p in zip([0.0, *inner, 360.0], [*torques, torques[0]], strict=True)]
    if drive == "free" and rng.random() < 0.3:
        del made["drive"]["body"]
    if case == "smooth" and rng.random() < 0.25:
        return made  # at rest
    ratios = linkage.ratios(frames)
    mover = rng.choice([b for b in made["body"] if b != "slider" and ratios[b] > 0.3]).item()
    speed = rng.uniform(6, 15) if case == "change-point" else rng.uniform(2, 10)
    rate = speed * rng.choice([-1, 1]) / max(1, *ratios.values())
    velocity = linkage.centroid(frames, mover).d * rate
    if rng.random() < 0.3 and abs(velocity.imag) > abs(velocity.real) / 2:
        rates = {"vy": velocity.imag}
    else:
        rates = {"omega": frames[mover].angular[0] * rate}
    made["initial"].setdefault(mover, {}).update({key: float(value) for key, value in rates.items()})
    if rng.random() < 0.3:  # the position by another coordinate
        row = made["initial"]["crank"]
        del row["angle_deg"]
        mover = rng.choice(list(made["body"])).item()
        slope = linkage.centroid(frames, mover).d
        key = "x" if abs(slope.real) > abs(slope.imag) else "y"
        if abs(slope) < 0.02:
            return None
        place = linkage.centroid(frames, mover).v
        made["initial"].setdefault(mover, {})[key] = float(place.real if key == "x" else place.imag)
        made["initial"] = {body: row for body, row in made["initial"].items() if row}
    return made


def scan(linkage):
    """Return the smallest singular value of a turn over that of the start, 0 where the linkage does not close."""
    values = []
    for k in range(145):
        try:
            values.append(linkage.rank(linkage.place(linkage.q + math.copysign(k * math.pi / 72, linkage.rate))))
        except Lost:
            return 0.0
    return min(values) / values[0]


def bar_lengths(rng, case, drive):
    """Return crank, rod, rocker, ground: by Grashof's sum of shortest and longest less the others."""
    while True:
        lengths = rng.uniform(0.1, 0.5, 4)
        s, p, q, longest = np.sort(lengths)
        if case == "change-point":
            style = rng.random()
            if style < 0.2:  # parallelogram
                lengths = lengths[[0, 1, 0, 1]]
            elif style < 0.3:  # kite
                lengths = lengths[[0, 1, 1, 0]]
            else:
                lengths[np.argmax(lengths)] = p + q - s
            return [float(x) for x in lengths] if lengths.max() < 0.8 else bar_lengths(rng, case, drive)
        signs = [lengths @ (1, i, j, k) for i in (-1, 1) for j in (-1, 1) for k in (-1, 1)]
        if min(map(abs, signs)) > 0.03 and (case != "dead" or s + longest > p + q):
            return [float(x) for x in lengths]


def slider_lengths(rng, case):
    """Return crank, rod and the line's distance from O."""
    a, b = rng.uniform(0.1, 0.4, 2).tolist()
    if case == "change-point":
        return a, a, 0.0
    offset = rng.uniform(-0.1, 0.1)
    if case == "dead":
        return max(a, b), min(a, b), offset
    if min(abs(abs(a - b) - abs(offset)), abs(a + b - abs(offset))) < 0.03:
        return slider_lengths(rng, case)
    return a, b, offset


def corner(P, r, Q, s, side):
    """Return the third corner of a triangle, or None."""
    D = Q - P
    along = 0.5 + (r * r - s * s) / (2 * abs(D) ** 2)
    high = r * r / abs(D) ** 2 - along**2
    return P + D * (along + 1j * side * math.sqrt(high)) if high > 0 else None


def link(rng, P, Q, pins, ends):
    """Return a body from P to Q and its angle (deg): half by length, half in a frame of its own."""
    length = abs(Q - P)
    turn, origin = (Q - P) / length, P
    keys = {ends[0]: "start", ends[1]: "end"}
    mass = rng.uniform(0.2, 3)
    body = {"mass": mass, "inertia": mass * length**2 / 12 * rng.uniform(0.5, 2)}
    center = P + (Q - P) * complex(rng.uniform(0.2, 0.8), rng.uniform(-0.15, 0.15))
    if rng.random() < 0.5:
        body["length"] = length
    else:
        turn *= np.exp(1j * rng.uniform(-3, 3))
        origin = P + complex(*rng.uniform(-0.2, 0.2, 2))
        keys = {}
    body["centroid"] = pair((center - origin) / turn)
    body["points"] = {keys.get(pin, pin): pair((place - origin) / turn) for pin, place in pins.items()}
    if keys:
        body["points"] |= {"start": [0.0, 0.0], "end": [length, 0.0]}
    return body, math.degrees(np.angle(turn))


def point(bodies, body, pin):
    """Return the name of a body's point at a pin."""
    points = bodies[body]["points"]
    if pin in points:
        return pin
    return "start" if pin in "ODF" or (pin, body) in (("A", "rod"), ("C", "rocker")) else "end"


def springs(rng, bodies, places, case):
    """Return up to two springs, from the frame to a centroid or between two bodies."""
    table = {}
    for k in range(rng.integers(0, 3)):
        first, second = rng.permutation(list(bodies))[:2].tolist()
        spring = {"joins": [f"{first}.centroid", f"{second}.centroid"], "point": [0.0, 0.0]}
        if rng.random() < 0.7:
            away = places["A"] + 1.5 * np.exp(1j * rng.uniform(-math.pi, math.pi))
            spring = {"joins": ["frame", f"{second}.centroid"], "point": pair(away)}
        spring |= {"stiffness": rng.uniform(20, 500), "length": rng.uniform(0.05, 1.5)}
        spring["damping"] = 0.0 if rng.random() < 0.5 or case == "change-point" else rng.uniform(0.5, 10)
        table[f"S{k}"] = spring
    return table


def drive_table(rng, driven, drive):
    if drive == "speed":
        return {"body": driven, "speed_rpm": rng.uniform(30, 200) * rng.choice([-1, 1]).item()}
    return {"body": driven, "free": True} if drive == "free" else {"body": driven}


def pair(z):
    return [float(z.real), float(z.imag)]
