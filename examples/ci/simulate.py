"""Stands for your program: writes the table of a pendulum of 0.5 m that is let go at 0.5 rad."""

import math
import sys
from pathlib import Path

LENGTH, GRAVITY, STEP = 0.5, 9.81, 1e-3  # m, m/s^2, s


def acceleration(angle):
    """Return the angular acceleration, rad/s^2."""
    return -GRAVITY / LENGTH * math.sin(angle)


lines, angle, speed = ["time [s],angle [rad],speed [rad/s]"], 0.5, 0.0
for number in range(2001):
    if number % 10 == 0:
        lines.append(f"{number * STEP:.2f},{angle:.9f},{speed:.9f}")
    middle = speed + STEP / 2 * acceleration(angle)
    angle += STEP * middle
    speed = middle + STEP / 2 * acceleration(angle)
Path(sys.argv[1]).write_text("\n".join(lines) + "\n", "utf-8")
