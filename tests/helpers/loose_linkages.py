"""Random linkages with one to three clearances: four-bars, slider-cranks, and levers with a guide on them.

`scene(kind, i)` is the same at every call. Contacts follow after some milliseconds.
"""

import copy
import math
import zlib

import numpy as np
import random_linkages
from random_linkages import body_of, name_of, pair

KINDS = ("four-bar", "slider-crank", "lever")
DRIVES = ("speed", "free", "torque")


def scene(kind, i):
    """Return the complete mapping of one random scene."""
    rng = np.random.default_rng([zlib.crc32(b"loose " + kind.encode()), i])
    if kind == "lever":
        drawn = lever(rng, DRIVES[i % 3])
    else:
        drawn = random_linkages.scene(kind, 5 * (i // 3) + (1, 2, 4)[i % 3])
    drawn["scene"] = {"name": f"loose-{kind}-{i}", "title": f"{kind} {i}", "description": ""}
    drawn["contact"], drawn["friction"] = laws(rng)
    joints = [*drawn["pin"], *drawn["guide"]]
    loose = rng.choice(joints, min(len(joints), rng.integers(1, 4)), replace=False).tolist()
    moves = "speed_rpm" in drawn["drive"] or any("omega" in row for row in drawn["initial"].values())
    drawn["clearance"] = {name: clearance(rng, drawn, name, moves) for name in loose}
    if i % 5 == 4:  # centred and at rest there
        for row in drawn["clearance"].values():
            row |= {
                key: (0 * np.array(row[key])).tolist() for key in row if key.startswith(("offset", "tilt"))
            }
    drawn["output"]["groups"] = ["accelerations", "joints", "contacts", "energy"]
    return drawn


def shorten(drawn, end, samples=40):
    """Return a scene that ends near there, at a divisor of its turn."""
    drawn = copy.deepcopy(drawn)
    if "speed_rpm" in drawn["drive"]:
        per_cycle = max(2, round(60 / abs(drawn["drive"]["speed_rpm"]) / end * samples))
        drawn["drive"]["cycles"], drawn["output"]["samples_per_cycle"] = samples / per_cycle, per_cycle
    else:
        drawn["output"] |= {"duration": end, "samples": samples}
    drawn["solver"]["exudyn"]["step"] = end / samples / math.ceil(end / samples / 1e-6)
    return drawn


def clearance(rng, drawn, name, moves):
    """Return the clearance of a joint, with offsets inside it and, where the linkage moves, their rates."""
    size, rate = 10 ** rng.uniform(-4, -3), 0.05 * moves
    if name in drawn["pin"]:
        offset = rng.uniform(0, 0.7) * size * np.exp(1j * rng.uniform(-math.pi, math.pi))
        row = {"size": size, "journal_radius": rng.uniform(0.005, 0.03), "offset": pair(offset)}
        row["offset_rate"] = pair(rate * complex(*rng.uniform(-1, 1, 2)))
    else:
        length, width = rng.uniform(0.02, 0.2), rng.uniform(0.01, 0.1)
        row = {"size": size, "length": length, "width": width, "corner_radius": 10 ** rng.uniform(-3.5, -2)}
        row |= {"offset": size * rng.uniform(-0.5, 0.5), "offset_rate": rate * rng.uniform(-1, 1)}
        row |= {"tilt_deg": math.degrees(size / length * rng.uniform(-0.6, 0.6))}
        row |= {"tilt_rate": rate / length * rng.uniform(-1, 1)}
    row["contact"], row["friction"] = (
        laws(rng) if rng.random() < 0.5 else (drawn["contact"], drawn["friction"])
    )
    return row


def laws(rng):
    """Return a contact law and friction."""
    law = "adams-impact" if rng.random() < 0.3 else "hertz-corners"
    contact = {"law": law, "youngs_modulus": 10 ** rng.uniform(9, 11), "poisson": rng.uniform(0.2, 0.4)}
    models = ["lankarani-nikravesh", "hunt-crossley", "flores", "gonthier"]
    contact |= {"restitution": rng.uniform(0.5, 1), "damping_model": rng.choice(models).item()}
    contact |= {"exponent": rng.choice([1.5, 1.5, 1.5, 1.2, 2.0]).item(), "impact_speed_floor": 1e-4}
    contact |= {"damping": 10 ** rng.uniform(1, 3), "damping_depth": 10 ** rng.uniform(-5, -4)}
    if law == "adams-impact":  # of no use there, hence as by default
        contact |= {"restitution": 0.9, "damping_model": "lankarani-nikravesh"}
        contact |= {"stiffness": 10 ** rng.uniform(7, 9)} if rng.random() < 0.5 else {}
    else:
        contact |= {"damping": 260.0, "damping_depth": 1e-5}
    friction = {"coefficient": rng.uniform(0.05, 0.3) if rng.random() < 0.5 else 0.0}
    return contact, friction | {"static_speed": 1e-3, "transition_speed": 1e-2}


def lever(rng, drive):
    """Return a crank and a lever on the frame, and a block at the crank's end in a guide on the lever."""
    pins = {"O": ("frame", "crank"), "A": ("crank", "block"), "C": ("frame", "lever")}
    place = {pin: complex(*rng.uniform(-0.2, 0.2, 2)) for pin in "OAC"}
    place["A"] = place["O"] + rng.uniform(0.08, 0.2) * np.exp(1j * rng.uniform(-math.pi, math.pi))
    place["C"] = place["O"] + rng.uniform(0.25, 0.4) * np.exp(1j * rng.uniform(-math.pi, math.pi))
    bodies, angles = {}, {}
    for body in rng.permutation(["crank", "block", "lever"]).tolist():
        bodies[body], angles[body] = body_of(rng, {p: place[p] for p, ends in pins.items() if body in ends})
    drawn = {"body": bodies, "pin": {}, "spring": {}}
    for pin, (one, other) in pins.items():
        at = pair(place[pin] if one == "frame" else 0j)
        ends = [name_of(pins, bodies, body, pin) for body in (one, other) if body != "frame"]
        ends = ["frame", *ends] if one == "frame" else rng.permutation(ends).tolist()
        drawn["pin"][pin] = {"joins": ends, "point": at}
    turn = {body: np.exp(1j * math.radians(angle)) for body, angle in angles.items()}
    arm = complex(*bodies["block"]["centroid"]) - complex(*bodies["block"]["points"]["A"])
    middle = place["A"] + turn["block"] * arm - place["C"]
    along = middle / abs(middle) * np.exp(1j * rng.uniform(-1, 1)) / turn["lever"]
    foot = complex(*bodies["lever"]["points"]["C"]) + middle / turn["lever"] + along * rng.uniform(-0.1, 0.1)
    guide = {
        "body": "block",
        "on": "lever",
        "point": pair(foot),
        "direction_deg": math.degrees(np.angle(along)),
    }
    drawn["guide"] = {"G": guide | {"angle_deg": angles["block"] - angles["lever"]}}
    drawn["initial"] = {"crank": {"angle_deg": angles["crank"]}}
    drawn["guess"] = {body: {"angle_deg": float(round(angle))} for body, angle in angles.items()}
    drawn["environment"] = {"gravity": 9.81}
    if drive == "speed":
        speed = rng.uniform(30, 200) * rng.choice([-1, 1]).item()
        drawn["drive"] = {"body": "crank", "speed_rpm": speed, "cycles": 1.0}
        drawn["output"] = {"samples_per_cycle": 100}
    else:
        drawn["drive"] = {"body": "crank", **({"free": True} if drive == "free" else {"torque": 3.0})}
        drawn["output"] = {"duration": 0.5, "samples": 100}
        drawn["initial"]["crank"]["omega"] = rng.uniform(3, 10) * rng.choice([-1, 1]).item()
    drawn["solver"] = {
        "reference": {"formulation": "auto", "method": "dop853", "tolerance": 1e-10},
        "exudyn": {"formulation": "full", "method": "auto", "step": 1e-6, "tolerance": 1e-8},
    }
    return drawn
