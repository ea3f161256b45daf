"""Random linkage scenes: four-bars, slider-cranks, Watt and Stephenson six-bars, levers with a guide on them.

`scene(kind, i)` and `loose_scene(kind, i)` are the same at every call. Of five in a row one has the lengths
of a change point and one is driven by its speed until it locks; the others turn freely if driven by speed,
else swing as they like.
"""

import copy
import math
import zlib

import numpy as np
from linkage_oracle import Bodies, LostError

KINDS = ("four-bar", "slider-crank", "watt", "stephenson")
LOOSE = ("four-bar", "slider-crank", "lever")
CASES = ("change-point", "smooth", "smooth", "locks", "smooth")
DRIVES = ("speed", "free", "torque", "torque_table")
FOUR_BAR = {"O": ("frame", "crank"), "A": ("crank", "rod"), "B": ("rod", "rocker"), "C": ("frame", "rocker")}
SLIDER_CRANK = {"O": ("frame", "crank"), "A": ("crank", "rod"), "B": ("rod", "slider")}
LEVER = {"O": ("frame", "crank"), "A": ("crank", "slider"), "C": ("frame", "rod")}
# A six-bar's second dyad joins neighbours of the first loop in Watt's chain, opposite links in Stephenson's.
HANGS = {
    "watt": (("rod", "rocker"), ("crank", "rod"), ("frame", "rocker"), ("frame", "crank")),
    "stephenson": (("frame", "rod"), ("crank", "rocker")),
}


def scene(kind, i):
    rng = np.random.default_rng([zlib.crc32(kind.encode()), i])
    case, k = CASES[i % 5], i // 5
    drive = DRIVES[(k + i) % 4] if case == "smooth" else "speed"
    if case == "change-point" and k % 2:
        drive = DRIVES[1 + k // 2 % 3]
    while True:
        try:
            data = draw(rng, kind, case, drive)
            if data and drive_it(rng, data, case, drive):
                title = f"{kind} {i}: {case}, {drive}"
                data["scene"] = {"name": f"{kind}-{i}", "title": title, "description": ""}
                return data
        except LostError:
            pass


def draw(rng, kind, case, drive):
    """Return a linkage with its springs and drive, or None where its lengths cannot be."""
    pins = dict({"slider-crank": SLIDER_CRANK, "lever": LEVER}.get(kind, FOUR_BAR))
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
        places = {pin: place[pin] for pin, ends in pins.items() if body in ends}
        bodies[body], angles[body] = body_of(rng, places)
    data = {"body": bodies, "pin": {}, "guide": {}, "spring": {}}
    for pin, ends in pins.items():
        if ends[0] == "frame":
            joins = ["frame", name_of(pins, bodies, ends[1], pin)]
        else:
            joins = [name_of(pins, bodies, body, pin) for body in rng.permutation(ends).tolist()]
        data["pin"][pin] = {"joins": joins, "point": pair(place[pin] if ends[0] == "frame" else 0j)}
    if "slider" in bodies:  # its guide is on the frame, or on a lever
        pin, on = ("A", "rod") if kind == "lever" else ("B", "frame")
        slider, turn = bodies["slider"], math.radians(angles.get(on, 0.0))
        arm = complex(*slider["centroid"]) - complex(*slider["points"][pin])
        point = (
            place[pin] + np.exp(1j * math.radians(angles["slider"])) * arm + along * rng.uniform(-0.1, 0.1)
        )
        if kind == "lever":
            point = (point - place["C"]) * np.exp(-1j * turn) + complex(*bodies[on]["points"]["C"])
        guide = {"body": "slider", "on": on, "point": pair(point)}
        guide["direction_deg"] = math.degrees(np.angle(along * np.exp(-1j * turn)))
        data["guide"]["G"] = guide | {"angle_deg": angles["slider"] - angles.get(on, 0.0)}
    for k in range(rng.integers(0, 3)):
        one, other = rng.permutation(names)[:2].tolist()
        joins = [f"{one}.centroid" if rng.random() < 0.3 else "frame", f"{other}.centroid"]
        spring = {"joins": joins, "point": pair(1.5 * np.exp(1j * rng.uniform(-math.pi, math.pi)))}
        spring |= {"stiffness": rng.uniform(20, 200), "length": rng.uniform(0.05, 1.5)}
        spring["damping"] = 0.0 if rng.random() < 0.5 or case == "change-point" else rng.uniform(0.5, 10)
        data["spring"][f"S{k}"] = spring
    driver = rng.choice(["crank", "rod"] if case == "smooth" else ["crank"]).item()
    groups = {"groups": ["accelerations", "joints", "energy"]}
    if drive == "speed":
        speed = rng.uniform(30, 200) * rng.choice([-1, 1]).item()
        duration = 60 / abs(speed)
        data["drive"] = {"body": driver, "speed_rpm": speed, "cycles": 1.0}
        data["output"] = {"samples_per_cycle": 100} | groups
    else:
        duration = round(rng.uniform(0.4, 1.0), 1)
        data["drive"] = {"body": driver} | ({"free": True} if drive == "free" else {})
        data["output"] = {"duration": duration, "samples": 100} | groups
    data["environment"] = {"gravity": 9.81 if rng.random() < 0.7 else 0.0}
    data["initial"] = {driver: {"angle_deg": angles[driver]}}
    data["guess"] = {body: {"angle_deg": float(round(angle))} for body, angle in angles.items()}
    data["solver"] = {
        "reference": {"formulation": "auto", "method": "dop853", "tolerance": 1e-10},
        "exudyn": {"formulation": "full", "method": "auto", "step": duration / 20_000, "tolerance": 1e-8},
    }
    return data


def drive_it(rng, data, case, drive):
    """Add load, torque and rates; return True for a linkage that moves as its case says."""
    linkage = Bodies(data)
    start = linkage.start
    if linkage.rank(start) < 0.1:
        return False
    if rng.random() < 0.25:
        k = rng.integers(len(linkage.names))
        surface = start.pose[3 * k + 1] + rng.uniform(-0.05, 0.02)
        load = {"body": linkage.names[k], "surface": float(surface), "force": rng.uniform(10, 60)}
        load |= {"table": [], "depth": 0.05, "exponent": rng.choice([1.0, 1.5, 2.0]).item()}
        if rng.random() < 0.3:
            rows = [[0.0, 0.0], [0.02, rng.uniform(5, 30)], [0.1, rng.uniform(0, 60)]]
            load |= {"force": 0.0, "table": rows}
        data["load"] = load
    if drive == "speed":
        lowest = scan(linkage)
        return {"smooth": lowest > 0.1, "locks": lowest == 0, "change-point": lowest < 0.1}[case]
    slope = start.slope[:, 0] / start.slope[linkage.driven, 0]
    turns = np.abs(slope[2::3])
    inertia = float(linkage.mass @ slope**2 / turns.max() ** 2)
    if drive == "torque":
        data["drive"]["torque"] = inertia * rng.uniform(-30, 30)
    if drive == "torque_table":
        degrees = [0.0, *np.sort(rng.uniform(20, 340, rng.integers(2, 6))).tolist(), 360.0]
        torques = (inertia * rng.uniform(-40, 40, len(degrees))).tolist()
        torques[-1] = torques[0]
        data["drive"]["torque_table"] = [list(row) for row in zip(degrees, torques, strict=True)]
    if case == "smooth" and rng.random() < 0.2:
        return True  # from rest
    k = int(rng.choice(np.flatnonzero(turns > 0.3 * turns.max())))
    rate = rng.choice([-1, 1]) * (rng.uniform(6, 15) if case == "change-point" else rng.uniform(2, 10))
    slope /= slope[3 * k + 2]
    rate /= max(1.0, np.abs(slope[2::3]).max())
    velocity = complex(*slope[3 * k : 3 * k + 2]) * rate
    key = rng.choice(["omega", "vx", "vy"], p=[0.7, 0.15, 0.15]).item()
    value = {"omega": rate, "vx": velocity.real, "vy": velocity.imag}[key]
    if abs(value) < 0.3 * min(abs(rate), abs(velocity)):
        return False
    data["initial"].setdefault(linkage.names[k], {})[key] = float(value)
    if rng.random() < 0.3:  # the position by a centroid's coordinate
        (driver,) = [body for body, row in data["initial"].items() if "angle_deg" in row]
        del data["initial"][driver]["angle_deg"]
        along = np.abs(slope[3 * k : 3 * k + 2])
        if np.hypot(*along) < 0.03:
            return False
        axis = 0 if along[0] > along[1] else 1
        data["initial"][linkage.names[k]]["xy"[axis]] = float(start.pose[3 * k + axis])
        data["initial"] = {body: row for body, row in data["initial"].items() if row}
    return True


def scan(linkage):
    """Return the smallest singular value of a turn over that of the start, 0 where the linkage locks."""
    try:
        times = np.arange(181) * math.pi / 90 / abs(linkage.rate)
        low = min(linkage.rank(linkage.look(t, np.empty(0), np.empty(0))) for t in times)
    except LostError:
        return 0.0
    return low / linkage.rank(linkage.start)


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


def loose_scene(kind, i):
    """Return a scene with one to three clearances, in which contacts follow after some milliseconds."""
    rng = np.random.default_rng([zlib.crc32(b"loose " + kind.encode()), i])
    data = scene(kind, 5 * (i // 3) + (1, 2, 4)[i % 3])
    data["scene"] = {"name": f"loose-{kind}-{i}", "title": f"{kind} {i}", "description": ""}
    data["contact"], data["friction"] = laws(rng)
    joints = [*data["pin"], *data["guide"]]
    names = rng.choice(joints, min(len(joints), rng.integers(1, 4)), replace=False).tolist()
    moves = "speed_rpm" in data["drive"] or any("omega" in row for row in data["initial"].values())
    data["clearance"] = {name: clearance(rng, data, name, moves) for name in names}
    if i % 5 == 4:  # centred and at rest there
        for row in data["clearance"].values():
            row |= {
                key: (0 * np.array(row[key])).tolist() for key in row if key.startswith(("offset", "tilt"))
            }
    data["output"]["groups"] = ["accelerations", "joints", "contacts", "energy"]
    return data


def shorten(data, end, samples=40):
    """Return a scene that ends near a time, at a divisor of its turn."""
    data = copy.deepcopy(data)
    if "speed_rpm" in data["drive"]:
        per_cycle = max(2, round(60 / abs(data["drive"]["speed_rpm"]) / end * samples))
        data["drive"]["cycles"], data["output"]["samples_per_cycle"] = samples / per_cycle, per_cycle
    else:
        data["output"] |= {"duration": end, "samples": samples}
    data["solver"]["exudyn"]["step"] = end / samples / math.ceil(end / samples / 1e-6)
    return data


def clearance(rng, data, name, moves):
    """Return the clearance of a joint, with offsets inside it and, where the linkage moves, their rates."""
    size, rate = 10 ** rng.uniform(-4, -3), 0.05 * moves
    if name in data["pin"]:
        offset = rng.uniform(0, 0.7) * size * np.exp(1j * rng.uniform(-math.pi, math.pi))
        row = {"size": size, "journal_radius": rng.uniform(0.005, 0.03), "offset": pair(offset)}
        row["offset_rate"] = pair(rate * complex(*rng.uniform(-1, 1, 2)))
    else:
        length, width = rng.uniform(0.02, 0.2), rng.uniform(0.01, 0.1)
        row = {"size": size, "length": length, "width": width, "corner_radius": 10 ** rng.uniform(-3.5, -2)}
        row |= {"offset": size * rng.uniform(-0.5, 0.5), "offset_rate": rate * rng.uniform(-1, 1)}
        row |= {"tilt_deg": math.degrees(size / length * rng.uniform(-0.6, 0.6))}
        row |= {"tilt_rate": rate / length * rng.uniform(-1, 1)}
    row["contact"], row["friction"] = laws(rng) if rng.random() < 0.5 else (data["contact"], data["friction"])
    return row


def laws(rng):
    law = "adams-impact" if rng.random() < 0.3 else "hertz-corners"
    contact = {"law": law, "youngs_modulus": 10 ** rng.uniform(9, 11), "poisson": rng.uniform(0.2, 0.4)}
    models = ["lankarani-nikravesh", "hunt-crossley", "flores", "gonthier"]
    contact |= {"restitution": rng.uniform(0.5, 1), "damping_model": rng.choice(models).item()}
    contact |= {"exponent": rng.choice([1.5, 1.5, 1.5, 1.2, 2.0]).item(), "impact_speed_floor": 1e-4}
    contact |= {"damping": 10 ** rng.uniform(1, 3), "damping_depth": 10 ** rng.uniform(-5, -4)}
    if law == "adams-impact":  # keys without a use there have their defaults
        contact |= {"restitution": 0.9, "damping_model": "lankarani-nikravesh"}
        contact |= {"stiffness": 10 ** rng.uniform(7, 9)} if rng.random() < 0.5 else {}
    else:
        contact |= {"damping": 260.0, "damping_depth": 1e-5}
    friction = {"coefficient": rng.uniform(0.05, 0.3) if rng.random() < 0.5 else 0.0}
    return contact, friction | {"static_speed": 1e-3, "transition_speed": 1e-2}
