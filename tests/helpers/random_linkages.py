"""Random linkage scenes: four-bars, slider-cranks, Watt and Stephenson six-bars.

`scene(kind, i)` is the same at every call. Of five in a row one has the lengths of a change point and one is
driven by its speed until it locks; the others turn freely if driven by speed, else swing as they like.
"""

import math
import zlib

import numpy as np
from linkage_oracle import Linkage, LostError

KINDS = ("four-bar", "slider-crank", "watt", "stephenson")
CASES = ("change-point", "smooth", "smooth", "locks", "smooth")
DRIVES = ("speed", "free", "torque", "torque_table")
FOUR_BAR = {"O": ("frame", "crank"), "A": ("crank", "rod"), "B": ("rod", "rocker"), "C": ("frame", "rocker")}
SLIDER_CRANK = {"O": ("frame", "crank"), "A": ("crank", "rod"), "B": ("rod", "slider")}
# A six-bar's second dyad joins neighbours of the first loop in Watt's chain, opposite links in Stephenson's.
HANGS = {
    "watt": (("rod", "rocker"), ("crank", "rod"), ("frame", "rocker"), ("frame", "crank")),
    "stephenson": (("frame", "rod"), ("crank", "rocker")),
}


def scene(kind, i):
    """Return the complete mapping of one random scene."""
    rng = np.random.default_rng([zlib.crc32(kind.encode()), i])
    case, k = CASES[i % 5], i // 5
    drive = DRIVES[(k + i) % 4] if case == "smooth" else "speed"
    if case == "change-point" and k % 2:
        drive = DRIVES[1 + k // 2 % 3]
    while True:
        try:
            drawn = draw(rng, kind, case, drive)
            if drawn and drive_it(rng, drawn, case, drive):
                title = f"{kind} {i}: {case}, {drive}"
                drawn["scene"] = {"name": f"{kind}-{i}", "title": title, "description": ""}
                return drawn
        except LostError:
            pass


def draw(rng, kind, case, drive):
    """Return a linkage with its springs and drive, or None where its lengths cannot be."""
    pins = dict(SLIDER_CRANK if kind == "slider-crank" else FOUR_BAR)
    if kind in HANGS:
        one, other = HANGS[kind][rng.integers(len(HANGS[kind]))]
        pins |= {"D": (one, "five"), "E": ("five", "six"), "F": (other, "six")}
    place = {pin: complex(*rng.uniform(-0.3, 0.3, 2)) for pin in (*pins, "C")}
    along = np.exp(1j * rng.uniform(-math.pi, math.pi))
    if case == "change-point":
        O, A, B = (place[pin] for pin in "OAB")  # noqa: E741
        if kind == "slider-crank":  # crank and rod of one length, the line through O
            place["B"] = O + 2 * ((A - O) * along.conjugate()).real * along
        else:  # one sum of lengths, with signs, is 0
            signs, c = rng.choice([-1, 1], 2), rng.uniform(0.1, 0.4)
            d, base = abs(abs(A - O) + signs @ (abs(B - A), c)), abs(B - O)
            foot = (base**2 + d**2 - c**2) / (2 * base)
            if abs(foot) > 0.9 * d:
                return None
            place["C"] = O + (foot + 1j * math.sqrt(d**2 - foot**2)) * (B - O) / base
    spots = [place[pin] for pin in pins]
    if min(abs(p - q) for k, p in enumerate(spots) for q in spots[:k]) < 0.1:
        return None
    names = sorted({body for ends in pins.values() for body in ends} - {"frame"})
    bodies, angles = {}, {}
    for body in rng.permutation(names).tolist():
        mine = {pin: place[pin] for pin, ends in pins.items() if body in ends}
        bodies[body], angles[body] = body_of(rng, mine)
    drawn = {"body": bodies, "pin": {}, "guide": {}, "spring": {}}
    for pin, ends in pins.items():
        if ends[0] == "frame":
            joins = ["frame", name_of(pins, bodies, ends[1], pin)]
        else:
            joins = [name_of(pins, bodies, body, pin) for body in rng.permutation(ends).tolist()]
        drawn["pin"][pin] = {"joins": joins, "point": pair(place[pin] if ends[0] == "frame" else 0j)}
    if kind == "slider-crank":
        slider = bodies["slider"]
        arm = complex(*slider["centroid"]) - complex(*slider["points"]["B"])
        middle = place["B"] + np.exp(1j * math.radians(angles["slider"])) * arm
        guide = {"body": "slider", "on": "frame", "point": pair(middle + along * rng.uniform(-0.1, 0.1))}
        guide |= {"direction_deg": math.degrees(np.angle(along)), "angle_deg": angles["slider"]}
        drawn["guide"]["G"] = guide
    for k in range(rng.integers(0, 3)):
        one, other = rng.permutation(names)[:2].tolist()
        joins = [f"{one}.centroid" if rng.random() < 0.3 else "frame", f"{other}.centroid"]
        spring = {"joins": joins, "point": pair(1.5 * np.exp(1j * rng.uniform(-math.pi, math.pi)))}
        spring |= {"stiffness": rng.uniform(20, 200), "length": rng.uniform(0.05, 1.5)}
        spring["damping"] = 0.0 if rng.random() < 0.5 or case == "change-point" else rng.uniform(0.5, 10)
        drawn["spring"][f"S{k}"] = spring
    driven = rng.choice(["crank", "rod"] if case == "smooth" else ["crank"]).item()
    groups = {"groups": ["accelerations", "joints", "energy"]}
    if drive == "speed":
        speed = rng.uniform(30, 200) * rng.choice([-1, 1]).item()
        duration = 60 / abs(speed)
        drawn["drive"] = {"body": driven, "speed_rpm": speed, "cycles": 1.0}
        drawn["output"] = {"samples_per_cycle": 100} | groups
    else:
        duration = round(rng.uniform(0.4, 1.0), 1)
        drawn["drive"] = {"body": driven} | ({"free": True} if drive == "free" else {})
        drawn["output"] = {"duration": duration, "samples": 100} | groups
    drawn["environment"] = {"gravity": 9.81 if rng.random() < 0.7 else 0.0}
    drawn["initial"] = {driven: {"angle_deg": angles[driven]}}
    drawn["guess"] = {body: {"angle_deg": float(round(angle))} for body, angle in angles.items()}
    drawn["solver"] = {
        "reference": {"formulation": "auto", "method": "dop853", "tolerance": 1e-10},
        "exudyn": {"formulation": "full", "method": "auto", "step": duration / 20_000, "tolerance": 1e-8},
    }
    return drawn


def drive_it(rng, drawn, case, drive):
    """Add load, torque and rates; return whether the linkage does what its case says."""
    linkage = Linkage(drawn)
    start = linkage.place(linkage.x[linkage.k])
    if linkage.rank(start) < 0.1:
        return False
    if rng.random() < 0.25:
        k = rng.integers(len(linkage.names))
        surface = start.centroids[0][k].imag + rng.uniform(-0.05, 0.02)
        load = {
            "body": linkage.names[k],
            "surface": float(surface),
            "force": rng.uniform(10, 60),
            "table": [],
        }
        load |= {"depth": 0.05, "exponent": rng.choice([1.0, 1.5, 2.0]).item()}
        if rng.random() < 0.3:
            rows = [[0.0, 0.0], [0.02, rng.uniform(5, 30)], [0.1, rng.uniform(0, 60)]]
            load |= {"force": 0.0, "table": rows}
        drawn["load"] = load
    if drive == "speed":
        lowest = scan(linkage, start)
        return {"smooth": lowest > 0.1, "locks": lowest == 0, "change-point": lowest < 0.1}[case]
    inertia = float(linkage.equation(start, 0.0)[0] / np.abs(start.angles[1]).max() ** 2)
    if drive == "torque":
        drawn["drive"]["torque"] = inertia * rng.uniform(-30, 30)
    if drive == "torque_table":
        degrees = [0.0, *np.sort(rng.uniform(20, 340, rng.integers(2, 6))).tolist(), 360.0]
        torques = (inertia * rng.uniform(-40, 40, len(degrees))).tolist()
        torques[-1] = torques[0]
        drawn["drive"]["torque_table"] = [list(row) for row in zip(degrees, torques, strict=True)]
    if case == "smooth" and rng.random() < 0.2:
        return True  # from rest
    k = int(rng.choice(np.flatnonzero(np.abs(start.angles[1]) > 0.3 * np.abs(start.angles[1]).max())))
    rate = rng.choice([-1, 1]) * (rng.uniform(6, 15) if case == "change-point" else rng.uniform(2, 10))
    slope = start.angles[1] / start.angles[1][k]
    rate /= max(1.0, np.abs(slope).max())
    velocity = start.centroids[1][k] / start.angles[1][k] * rate
    key = rng.choice(["omega", "vx", "vy"], p=[0.7, 0.15, 0.15]).item()
    value = {"omega": rate, "vx": velocity.real, "vy": velocity.imag}[key]
    if abs(value) < 0.3 * min(abs(rate), abs(velocity)):
        return False
    drawn["initial"].setdefault(linkage.names[k], {})[key] = float(value)
    if rng.random() < 0.3:  # the position by a centroid's coordinate
        (driven,) = [body for body, row in drawn["initial"].items() if "angle_deg" in row]
        del drawn["initial"][driven]["angle_deg"]
        where, slope = start.centroids[0][k], start.centroids[1][k]
        across = abs(slope.real) > abs(slope.imag)
        if abs(slope) < 0.03 * abs(start.angles[1][k]):
            return False
        key, value = ("x", where.real) if across else ("y", where.imag)
        drawn["initial"][linkage.names[k]][key] = float(value)
        drawn["initial"] = {body: row for body, row in drawn["initial"].items() if row}
    return True


def scan(linkage, start):
    """Return the smallest singular value of a turn over that of the start, 0 where the linkage locks."""
    first = linkage.rank(start)
    low, q = first, linkage.x[linkage.k]
    try:
        for k in range(1, 181):
            low = min(low, linkage.rank(linkage.place(q + math.copysign(k * math.pi / 90, linkage.rate))))
    except LostError:
        return 0.0
    return low / first


def body_of(rng, pins):
    """Return a body through given pins and its angle (deg): half by a length, half in a frame of its own."""
    places = list(pins.values())
    turn, origin = np.exp(1j * rng.uniform(-math.pi, math.pi)), complex(*rng.uniform(-0.3, 0.3, 2))
    names, body = list(pins), {"mass": rng.uniform(0.2, 3)}
    body["inertia"] = body["mass"] * rng.uniform(1e-3, 2e-2)
    if len(pins) > 1 and rng.random() < 0.5:
        body["length"], origin = abs(places[1] - places[0]), places[0]
        turn = (places[1] - places[0]) / body["length"]
        names[:2] = "start", "end"
    body["centroid"] = pair((np.mean(places) + complex(*rng.uniform(-0.05, 0.05, 2)) - origin) / turn)
    body["points"] = {name: pair((place - origin) / turn) for name, place in zip(names, places, strict=True)}
    if "length" in body:
        body["points"] |= {"start": [0.0, 0.0], "end": [body["length"], 0.0]}
    return body, math.degrees(np.angle(turn))


def name_of(pins, bodies, body, pin):
    """Return BODY.POINT of a pin: points are in the order of the pins."""
    k = [name for name, ends in pins.items() if body in ends].index(pin)
    return f"{body}.{list(bodies[body]['points'])[k]}"


def pair(z):
    return [float(z.real), float(z.imag)]
