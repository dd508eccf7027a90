"""Rows of table 2: which body, and which estimator."""

from __future__ import annotations

import dataclasses

import mocap_jax as mj
from mocap_jax.initialise import declared_pose
from sip2017.bodies import manual_body, scaled_body, subject_body, words_body, worn

ROWS = {
    "SOP": "orientations alone, frame by frame",
    "SIP-M": "body rigged by hand",
    "SIP-T1": "the subject's body, weights of table 1",
    "SIP": "the subject's body",
    "SIP-AO": "without rates, as the paper's",
    "SIP-BW": "body from stature alone",
    "SIP-110": "body 110 %",
    "SIP-120": "body 120 %",
    "EKF": "Kalman filter, forward only",
    "SIP-L": "with limits of ball joints",
    "SIP-KF": "started from the Kalman filter",
}
"""Rows of the table and what they are."""
ASKED_FOR = ("SIP-L", "SIP-KF")
"""Rows that are computed only where `--rows` names them."""
PAPER = {
    "SOP": (19.64, 17.35, 7.2, 8.9),
    "SIP-M": (18.24, 15.82, 6.0, 5.3),
    "SIP": (13.32, 10.13, 3.9, 4.0),
    "SIP-BW": (13.45, 9.94, 4.2, 4.0),
    "SIP-110": (13.67, 10.38, 4.6, 4.5),
    "SIP-120": (14.27, 10.6, 5.6, 5.3),
}
"""The paper's table 2: mean and deviation of the orientation error [deg], of the position [cm]."""


def estimate(
    row: str,
    recording: mj.Recording,
    sensors: tuple[str, ...],
    prior: mj.PosePrior,
    seed: int,
    limits: mj.JointLimits | None = None,
) -> mj.Solution:
    """The estimate of one row; limits are for SIP-L."""
    recording = dataclasses.replace(recording, root=None)  # nobody measures where the root is
    on, body = worn(recording, _body(row, recording, seed), sensors)
    options = dataclasses.replace(mj.sparse_options(prior), root="free", covariance=False)
    if row in ("EKF", "SIP-KF"):
        filtered = mj.ekf(on, body, options=mj.EkfOptions(kinds="AGO", root="free"))
        if row == "EKF":
            return filtered
        return mj.optimise(on, body, initial=filtered, options=options)
    start = mj.orientation_pass(
        on, body, start=declared_pose(on.setup.rest, body),
        options=mj.OrientationPassOptions(pose_prior=prior, warm_start=True),
    )  # fmt: skip
    if row == "SIP-AO":
        options = dataclasses.replace(options, kinds="AO")
    if row == "SIP-T1":
        rate = on.setup.sensors[0].rate_hz
        options = mj.table1_options(rate, len(sensors), prior)
    if row == "SIP-L" and limits is not None:
        residual, rows = mj.joint_limits(limits, body, start.trajectory.time)
        options = dataclasses.replace(options, user_residuals=(residual,))
        return mj.optimise(on, body, initial=start, options=options, user_data=(rows,))
    return start if row == "SOP" else mj.optimise(on, body, initial=start, options=options)


def _body(row: str, recording: mj.Recording, seed: int) -> mj.Body:
    if row == "SIP-M":
        return manual_body(recording, seed)
    if row == "SIP-BW":
        return words_body(recording)
    if row.startswith("SIP-1"):
        return scaled_body(recording, int(row.removeprefix("SIP-")) / 100)
    return subject_body(recording)
