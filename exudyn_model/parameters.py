"""What this model needs to know of a scene, in SI units (Tables 1 and 2).

``reading`` makes these from the plain mapping.
"""

from dataclasses import dataclass


@dataclass(frozen=True)
class Rod:
    """A rigid rod; its frame sits in the centroid, x along the rod, away from the first pin.

    Attributes
    ----------
    length, centroid : float
        Distances of the second pin and of the centroid from the first pin, m.
    mass, inertia : float
        kg; about the centroid, kg m^2.
    """

    length: float
    centroid: float
    mass: float
    inertia: float

    @property
    def to_tip(self) -> float:
        """Distance from the centroid to the second pin, m."""
        return self.length - self.centroid


@dataclass(frozen=True)
class Slider:
    """The slider, a rectangle about its centre of mass.

    Attributes
    ----------
    mass, inertia : float
        kg; about the centre, kg m^2.
    length, width : float
        Along the guide (y) and across it (x), m.
    """

    mass: float
    inertia: float
    length: float
    width: float


@dataclass(frozen=True)
class Mechanism:
    """The linkage of Fig. 4.

    Attributes
    ----------
    crank, rod2, rocker, rod4 : Rod
        Bodies 1 to 4. Rod 2 is pinned to the centroid of the rocker.
    slider : Slider
        Body 5.
    rocker_pivot : tuple of float
        Frame pivot H of the rocker, m; the crank's pivot is the origin.
    guide_x : float
        Centre line of the guide, m.
    reference_offset : float
        Line of the ideal slider, from the centre line of the guide, m.
    crank_angle : float
        At t = 0, rad.
    rocker_branch : int
        +1 where joint B lies to the left of the line from the crank's tip to H, -1 to the right.
    slider_branch : int
        +1 where rod 4 points up from the rocker's tip, -1 down.
    gravity : float
        Along -y, m/s^2.
    ideal_slider : bool
        Whether the slider is fixed to its line; else it has clearance in the guide.
    """

    crank: Rod
    rod2: Rod
    rocker: Rod
    rod4: Rod
    slider: Slider
    rocker_pivot: tuple[float, float]
    guide_x: float
    reference_offset: float
    crank_angle: float
    rocker_branch: int
    slider_branch: int
    gravity: float
    ideal_slider: bool


@dataclass(frozen=True)
class Drive:
    """The motor on the crank.

    Attributes
    ----------
    omega : float
        Angular speed, counter-clockwise positive, rad/s.
    period : float
        Duration of one cycle, s.
    cycles : float
        Number of cycles to simulate.
    """

    omega: float
    period: float
    cycles: float


@dataclass(frozen=True)
class Initial:
    """State of a slider with clearance at t = 0.

    Attributes
    ----------
    offset, angle : float
        x from the guide's centre line, m; rad.
    vx, omega : float
        Their rates, m/s and rad/s.
    """

    offset: float
    angle: float
    vx: float
    omega: float


@dataclass(frozen=True)
class Contact:
    """Contact of one point after Eqs. 9-14.

    Attributes
    ----------
    clearance : float
        m.
    stiffness : float
        K of Eq. 10, N/m^exponent.
    exponent : float
        n of Eq. 9.
    damping : float
        3 (1 - c_e^2) / 4: the damping term of Eq. 11 is this times K depth^n, times the ratio of the speed
        of penetration to the speed of impact.
    impact_speed : str
        What the damping refers to: "frozen" or "current"; see ``contact.point.damped``.
    impact_speed_floor : float
        Least speed of impact that is used, m/s.
    friction : float
        c_f of Eq. 12.
    static_speed, transition_speed : float
        v0 and v1 of Eq. 13, m/s.
    """

    clearance: float
    stiffness: float
    exponent: float
    damping: float
    impact_speed: str
    impact_speed_floor: float
    friction: float
    static_speed: float
    transition_speed: float


@dataclass(frozen=True)
class Guide(Contact):
    """The slider's contact with its guide; the clearance c_T is that on each side.

    Attributes
    ----------
    law : str
        Of the two corners of one side: one of ``contact.laws.LAWS``.
    side_stiffness : float
        K_s of Eq. 8, N/m.
    """

    law: str
    side_stiffness: float


@dataclass(frozen=True)
class Journal(Contact):
    """The crank pin's journal in its bearing; the clearance is the difference of their radii.

    Attributes
    ----------
    radius : float
        Of the journal, m.
    """

    radius: float


@dataclass(frozen=True)
class Integration:
    """Time integration and output.

    Attributes
    ----------
    formulation : str
        "full": five bodies; "native": with Exudyn's own contact; "tree": what the drive leaves free.
    method : str
        "generalized-alpha" or "trapezoidal-index2"; "dopri5" for "tree".
    step : float
        Largest step that the scene allows, s.
    tolerance : float
        Of the Newton iteration, absolute; see ``five_bodies.settings.newton_tolerance``. "tree": of a step's
        error, in rad and rad/s.
    samples_per_cycle : int
        Samples in one crank cycle.
    accelerations, corners, joints, energy : bool
        Groups of channels asked for.
    """

    formulation: str
    method: str
    step: float
    tolerance: float
    samples_per_cycle: int
    accelerations: bool
    corners: bool
    joints: bool
    energy: bool


@dataclass(frozen=True)
class Parameters:
    """Everything the model needs to know of a scene."""

    mechanism: Mechanism
    drive: Drive
    initial: Initial
    contact: Guide
    journal: Journal | None  # None: the crank pin is ideal
    integration: Integration

    @property
    def ideal(self) -> bool:
        """Whether no joint has clearance."""
        return self.mechanism.ideal_slider and self.journal is None

    @property
    def sample_interval(self) -> float:
        """Time between two samples, s."""
        return self.drive.period / self.integration.samples_per_cycle

    @property
    def samples(self) -> int:
        """Number of samples besides the one at t = 0."""
        return round(self.drive.cycles * self.integration.samples_per_cycle)
