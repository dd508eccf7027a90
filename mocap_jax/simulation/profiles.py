"""Profiles: how noisy, biased and ill-mounted the sensors of a simulated recording are.

Figures of `field` (standard deviations unless said otherwise) and what they rest on. White noise
is that of `paper`; where a source gives a span, the figure is our choice within it.

white noise: 0.02 m/s^2, 0.002 rad/s, 2.5 mm
    Vlasic 2007, section 5.2.
gyroscope bias: 0.5 deg/s; accelerometer bias: 0.15 m/s^2 (15 mg)
    InvenSense MPU-6000/6050 product specification 3.4: zero-rate output +-20 deg/s, zero-g output
    +-50 mg (x, y) and +-80 mg (z) before calibration. A calibration such as that of Vlasic 2007,
    section 4.3 leaves a few per cent of the first and, with temperature, more of the second.
gyroscope drift: 2e-4 rad/s/sqrt(s); accelerometer drift: 1e-3 m/s^2/sqrt(s)
    Rate and acceleration random walk in the MEMS error models of El-Sheimy, Hou, Niu 2008 (IEEE
    Trans. Instrum. Meas. 57, 140-149); 0.07 deg/s in 40 s.
orientation, where boards report one: 0.75 deg inclination, 1.5 deg heading, drifting within 10 s
    Xsens MTw Awinda user manual, 2018: dynamic accuracy (RMS). The 10 s are our choice. White noise
    0.3 deg, also in `paper`.
magnetic field, where it is simulated: hard iron 1 uT an axis, disturbance 3 uT that changes within
5 s
    Our choice: a twentieth of the field or so is left after calibration, and some 10 degrees of
    heading indoors (de Vries et al. 2009, Gait & Posture 29, 535-541, measured more near floors).
scale error: 1 %
    MPU-6050: +-3 % initial tolerance of both sensors; a third of it as standard deviation.
saturation: +-16 g, +-2000 deg/s
    MPU-6050: its largest ranges.
mounting rotation: 3 deg an axis; declared rest pose: 3 deg an axis and joint
    Static-pose calibration, Robert-Lachaine et al. 2017 (Gait & Posture 54, 80-86): errors and
    repeatability of a few degrees.
mounting position: 10 mm along the skin, 3 mm in depth
    Finding a place by palpation, Della Croce et al. 2005 (Gait & Posture 21, 226-237): 6-25 mm.
soft tissue: 8 Hz resonance, damping 0.3; sliding of 3 mm per rad of the segment's joint
    Wakeling and Nigg 2001 (J. Appl. Physiol. 90, 412-420): damped vibration of leg tissue at the
    frequencies of running impacts; 8 Hz is our choice for a board on cloth over it. Leardini et
    al. 2005 (Gait & Posture 21, 212-225): skin slides by millimetres to centimetres.
segment length: 3 %
    Regression from stature, Drillis and Contini 1966, in Winter 2009, chapter 4.
speed of sound: 0.7 %
    c = (331.3 + 0.606 T) m/s: an air temperature that is wrong by 4 degrees Celsius.
source offset: 2.3 mm
    Vlasic 2007, section 4.3: 2.35 mm mean error after calibration.
multipath: 3 % of pulses lose their direct sound and have a strong echo
    Our choice: a few per cent of gross positive errors are usual in acoustic ranging (Olson,
    Leonard, Teller 2006).
lost samples: 1 %, in bursts of 5 on average; clock offset: 2 ms
    Our choice for radio-connected boards of common rate without a common trigger (Vlasic's boards
    are wired to one driver box and have neither).
"""

from __future__ import annotations

from dataclasses import dataclass, field

from mocap_jax.errors import unknown_name
from mocap_jax.recording import NoiseFigures
from mocap_jax.simulation.hearing import HearingFigures

_DEGREE = 0.017453292519943295


@dataclass(frozen=True)
class Profile:
    """Errors of sensors, mounting, subject and air. Standard deviations; 0 means none."""

    name: str
    stated: NoiseFigures
    """White noise that the recording's set-up declares."""
    white: bool = True
    """Whether that white noise is really there."""
    detector: bool = True
    """Simulate amplitudes, echoes and confidence; False: exact ranges of all visible pairs."""
    gyroscope_bias: float = 0.0
    """At the start, per axis [rad/s]."""
    gyroscope_drift: float = 0.0
    """Random walk of the bias [rad/s/sqrt(s)]."""
    accelerometer_bias: float = 0.0
    """At the start, per axis [m/s^2]."""
    accelerometer_drift: float = 0.0
    """Random walk of the bias [m/s^2/sqrt(s)]."""
    orientation_tilt: float = 0.0
    """Slow error of reported orientations about each horizontal axis [rad]."""
    orientation_heading: float = 0.0
    """The same about the vertical [rad]."""
    orientation_time: float = 10.0
    """Correlation time of these slow errors [s]."""
    magnetic_bias: float = 0.0
    """Hard iron of a board's magnetometer, per axis [T]."""
    magnetic_disturbance: float = 0.0
    """Of the field where a board is, per axis of the world [T]."""
    magnetic_time: float = 5.0
    """Correlation time of this disturbance [s]."""
    scale: float = 0.0
    """Relative, per axis of either sensor."""
    gyroscope_limit: float = float("inf")
    """Saturation [rad/s]."""
    accelerometer_limit: float = float("inf")
    """Saturation [m/s^2]."""
    mounting_rotation: float = 0.0
    """Per axis [rad]."""
    mounting_slide: float = 0.0
    """Along the skin, per axis [m]; of sources as well."""
    mounting_depth: float = 0.0
    """Along the device's z axis [m]; of sources as well."""
    rest_pose: float = 0.0
    """Of the held pose about the declared one, per axis [rad]."""
    tissue_frequency: float = 0.0
    """Resonance of a board on soft tissue [Hz]; 0: boards are fixed."""
    tissue_damping: float = 0.3
    """Damping ratio of that resonance."""
    tissue_slide: float = 0.0
    """Sliding of the skin with the segment's own joint, per axis [m/rad]."""
    segment_length: float = 0.0
    """Relative, per segment (left and right alike)."""
    speed_of_sound: float = 0.0
    """Relative."""
    source_offset: float = 0.0
    """Constant error of each source's ranges [m]."""
    anchor_position: float = 0.0
    """Survey error of each anchor, per axis [m]."""
    anchor_temperature: float = 0.0
    """Error of each receiving anchor's thermometer, by which it turns times of flight into
    distances [K]."""
    multipath: float = 0.0
    """Share of pulses whose echo is taken for the direct sound."""
    loss: float = 0.0
    """Share of samples lost."""
    loss_burst: float = 5.0
    """Mean number of consecutive samples lost."""
    clock_offset: float = 0.0
    """Of each board's stamps [s]."""
    hearing: HearingFigures = field(default_factory=HearingFigures)


_PAPER_NOISE = NoiseFigures(orientation=0.005, root_position=0.002, root_orientation=0.005)

_IDEAL = Profile(
    "ideal",
    # Stated, so that estimators have weights; nothing is added to the readings.
    NoiseFigures(orientation=1e-3, root_position=1e-4, root_orientation=2e-4),
    white=False,
    detector=False,
)
_PAPER = Profile("paper", _PAPER_NOISE)
_FIELD = Profile(
    "field",
    _PAPER_NOISE,
    gyroscope_bias=0.5 * _DEGREE,
    gyroscope_drift=2e-4,
    accelerometer_bias=0.15,
    accelerometer_drift=1e-3,
    orientation_tilt=0.75 * _DEGREE,
    orientation_heading=1.5 * _DEGREE,
    magnetic_bias=1e-6,
    magnetic_disturbance=3e-6,
    scale=0.01,
    gyroscope_limit=2000 * _DEGREE,
    accelerometer_limit=16 * 9.81,
    mounting_rotation=3 * _DEGREE,
    mounting_slide=0.010,
    mounting_depth=0.003,
    rest_pose=3 * _DEGREE,
    tissue_frequency=8.0,
    tissue_slide=0.003,
    segment_length=0.03,
    speed_of_sound=0.007,
    source_offset=0.0023,
    multipath=0.03,
    loss=0.01,
    clock_offset=0.002,
)

PROFILES: dict[str, Profile] = {p.name: p for p in (_IDEAL, _PAPER, _FIELD)}
"""The profiles by name."""


def profile_named(name: str) -> Profile:
    """The profile of that name; raises `InputError` with the valid names."""
    if name not in PROFILES:
        raise unknown_name("profile", name, PROFILES)
    return PROFILES[name]
