"""Complete mappings of linkages' scenes, with and without clearance."""

import math
from dataclasses import replace

from reference_model.formulations import formulation, start
from reference_model.parameters import CORNERS, read_parameters

ALL = ["accelerations", "joints", "energy"]
G = 9.81


def rod(length=1.0, mass=1.0, inertia=None, centroid=None, **points):
    """Return a body with its pins at (0, 0) and (length, 0), homogeneous unless told."""
    return {
        "mass": mass,
        "inertia": mass * length**2 / 12.0 if inertia is None else inertia,
        "length": length,
        "points": {"start": [0.0, 0.0], "end": [length, 0.0]} | points,
        "centroid": [length / 2.0, 0.0] if centroid is None else centroid,
    }


def linkage(body, *, drive=None, tolerance=1e-10, gravity=G, duration=1.0, samples=100, groups=ALL, **tables):
    """Return the complete mapping of a linkage's scene."""
    output = {"groups": groups, "duration": duration, "samples": samples}
    if drive and "speed_rpm" in drive:
        output = {"groups": groups, "samples_per_cycle": samples}
    return {
        "scene": {"name": "linkage", "title": "", "description": ""},
        "body": body,
        "environment": {"gravity": gravity},
        "drive": drive or {"free": True},
        "output": output,
        "solver": {"reference": {"tolerance": tolerance, "formulation": "auto", "method": "dop853"}},
    } | tables


def pins(*joints):
    """Return pins from ends, or from a point of the frame and an end."""
    return {
        f"P{i}": {"joins": [a, b]} if isinstance(a, str) else {"joins": ["frame", b], "point": list(a)}
        for i, (a, b) in enumerate(joints)
    }


DOUBLE_FOUR_BAR = (
    ((0.0, 0.0), "left.start"),
    ("left.end", "top1.start"),
    ((1.0, 0.0), "middle.start"),
    ("top1.end", "middle.end"),
    ("middle.end", "top2.start"),
    ((2.0, 0.0), "right.start"),
    ("top2.end", "right.end"),
)
"""Pins of the IFToMM's A02."""
CONTACT = {
    "law": "hertz-corners",
    "youngs_modulus": 2.1e11,
    "poisson": 0.28,
    "restitution": 0.9,
    "damping_model": "lankarani-nikravesh",
    "exponent": 1.5,
    "impact_speed_floor": 1e-3,
    "damping": 260.0,
    "damping_depth": 1e-5,
}
FRICTION = {"coefficient": 0.0, "static_speed": 1e-3, "transition_speed": 1e-2}


def loose_guide(size, length, width, contact=None, friction=None, **others):
    """Return the table of a clearance at a guide, centred and at rest unless told."""
    start = {"offset": 0.0, "tilt_deg": 0.0, "offset_rate": 0.0, "tilt_rate": 0.0}
    sizes = {"size": size, "length": length, "width": width, "corner_radius": 1e-3}
    laws = {"contact": CONTACT | (contact or {}), "friction": FRICTION | (friction or {})}
    return sizes | start | laws | others


def loose_pin(size, contact=None, friction=None, **others):
    """Return the table of a clearance at a pin, centred and at rest unless told."""
    start = {"size": size, "journal_radius": 0.01, "offset": [0.0, 0.0], "offset_rate": [0.0, 0.0]}
    return start | {"contact": CONTACT | (contact or {}), "friction": FRICTION | (friction or {})} | others


def slider_crank(**tables):
    """Return the slider-crank of Flores, Leine and Glocker (2010); its slider is 0.1 m by 0.05 m."""
    body = {
        "crank": rod(0.153, 0.038, 7.4e-5),
        "rod": rod(0.306, 0.038, 5.9e-4),
        "slider": {"mass": 0.076, "inertia": 2.7e-6, "points": {}, "centroid": [0.0, 0.0]},
    }
    pin = {
        "O": {"joins": ["frame", "crank.start"], "point": [0.0, 0.0]},
        "A": {"joins": ["crank.end", "rod.start"]},
        "B": {"joins": ["rod.end", "slider.centroid"]},
    }
    guide = {"G": {"body": "slider", "on": "frame", "point": [0.0, 0.0], "direction_deg": 0.0}}
    usual = {"initial": {"crank": {"angle_deg": 0.0, "omega": 150.0}}, "groups": [*ALL, "contacts"]}
    return linkage(body, pin=pin, guide=guide, **(usual | tables))


def press(scene):
    """Return the press of a scene as a linkage: at its slider and its crank pin a clearance, or none."""
    p, m, laws = read_parameters(scene), scene["mechanism"], dict(scene["contact"])
    radius, laws["law"] = laws.pop("corner_radius"), scene["contact"]["law"]
    names = ("crank", "rod2", "rocker", "rod4", "slider")
    bodies = {
        name: {
            "mass": m[name]["mass"],
            "inertia": m[name]["inertia"],
            "centroid": [m[name].get("centroid", 0.0), 0.0],
            "points": {"start": [0.0, 0.0], "end": [m[name]["length"], 0.0]} if name != "slider" else {},
        }
        for name in names
    }
    joins = ("frame", "crank.start"), ("crank.end", "rod2.start"), ("frame", "rocker.start")
    joins += ("rod2.end", "rocker.centroid"), ("rocker.end", "rod4.start"), ("rod4.end", "slider.centroid")
    pin = {name: {"joins": [*ends]} for name, ends in zip("OAHBCF", joins, strict=True)}
    pin["H"]["point"] = m["rocker_pivot"]
    line = p.mechanism.line_x if p.ideal_slider else m["guide_x"]
    at = {
        "body": "slider",
        "on": "frame",
        "point": [line, 0.0],
        "direction_deg": 90.0,
        "angle_deg": 0.0,
    }
    model = formulation(replace(p, multipliers=True, ideal_pin=True))[0]
    places = start(p, model)[:15].reshape(5, 3).tolist()
    guess = {
        name: {"x": x, "y": y, "angle_deg": math.degrees(angle)}
        for name, (x, y, angle) in zip(names, places, strict=True)
    }
    clearance = {}
    if not p.ideal_pin:
        sizes = scene["clearance"]["crank_pin"], laws, scene["friction"]
        clearance["A"] = loose_pin(*sizes, journal_radius=scene["clearance"]["journal_radius"])
    if not p.ideal_slider:
        first, slider = scene["initial"], m["slider"]
        clearance["G"] = loose_guide(
            scene["clearance"]["slider"], slider["length"], slider["width"], laws, scene["friction"],
            corner_radius=radius, offset=-first["slider_offset"], offset_rate=-first["slider_vx"],
            tilt_deg=math.degrees(first["slider_angle"]), tilt_rate=first["slider_omega"],
        )  # fmt: skip
    return linkage(
        bodies,
        pin=pin,
        guide={"G": at},
        guess=guess,
        clearance=clearance,
        gravity=scene["environment"]["gravity"],
        drive={"body": "crank"} | {key: scene["drive"][key] for key in ("speed_rpm", "cycles")},
        initial={"crank": {"angle_deg": m["crank_angle_deg"]}},
        samples=scene["output"]["samples_per_cycle"],
        tolerance=scene["solver"]["reference"]["tolerance"],
        groups=[*ALL, "contacts"],
    )


NAMES = {"guide_moment": "G.moment", "pin": "A", "crank_torque": "drive.torque"}
"""Names in the linkage of what the press calls otherwise: channels and contacts."""
NAMES |= {
    f"slider_{word}": f"slider.{word}"
    for word in ("x", "y", "angle", "vx", "vy", "omega", "ax", "ay", "alpha")
}
NAMES |= {f"reaction_{pin}_{axis}": f"{pin}.reaction_{axis}" for pin in "OAHBCF" for axis in "xy"}
NAMES |= {
    f"corner_{corner}_{word}": f"G.{corner}_{word}"
    for corner in CORNERS
    for word in ("gap", "normal", "friction")
}
NAMES |= {corner: f"G.{corner}" for corner in CORNERS} | {f"journal_{axis}": f"A.{axis}" for axis in "xy"}
