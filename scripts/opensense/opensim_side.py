"""What runs in OpenSim itself; needs PyPI `opensim` alone, and nothing of this package.

python opensim_side.py kinematics MODEL OUT.json [SEED]
python opensim_side.py ik MODEL ORIENTATIONS.sto FOLDER START END
"""

from __future__ import annotations

import json
import sys
import time
from pathlib import Path

import numpy as np
import opensim

_TO_OPENSIM = (-np.pi / 2, 0.0, 0.0)


def kinematics(model_file: str, out: str, seed: str = "0") -> None:
    """World frames of all bodies at random coordinates within their ranges."""
    model = opensim.Model(model_file)
    state = model.initSystem()
    every = model.getCoordinateSet()
    coordinates = [every.get(i) for i in range(every.getSize())]
    couplers = {}
    constraints = model.getConstraintSet()
    for i in range(constraints.getSize()):
        coupler = opensim.CoordinateCouplerConstraint.safeDownCast(constraints.get(i))
        if coupler is not None:
            couplers[coupler.getDependentCoordinateName()] = coupler
    generator = np.random.default_rng(int(seed))
    poses = []
    for _ in range(20):
        q = {}
        for c in coordinates:
            if c.getLocked(state) or c.getName() in couplers:
                continue
            low, high = max(c.getRangeMin(), -3.0), min(c.getRangeMax(), 3.0)
            q[c.getName()] = float(generator.uniform(low, high))
        for name, value in q.items():
            model.getCoordinateSet().get(name).setValue(state, value, False)
        model.realizePosition(state)
        frames = {}
        bodies = model.getBodySet()
        for i in range(bodies.getSize()):
            X = bodies.get(i).getTransformInGround(state)
            R = [[X.R().get(r, k) for k in range(3)] for r in range(3)]
            frames[bodies.get(i).getName()] = {"R": R, "p": [X.p().get(k) for k in range(3)]}
        poses.append({"q": q, "frames": frames})
    Path(out).write_text(json.dumps(poses))


def ik(model_file: str, orientations: str, folder: str, start: str, end: str) -> None:
    """OpenSense: place the sensors in the model's default pose, then inverse kinematics."""
    opensim.Logger.setLevelString("error")
    out = Path(folder)
    placer = opensim.IMUPlacer()
    placer.set_model_file(model_file)
    placer.set_orientation_file_for_calibration(orientations)
    placer.set_sensor_to_opensim_rotations(opensim.Vec3(*_TO_OPENSIM))
    placer.set_base_imu_label("pelvis_imu")
    placer.set_base_heading_axis("z")
    calibrated = str(out / "calibrated.osim")
    placer.set_output_model_file(calibrated)
    placer.run(False)
    tool = opensim.IMUInverseKinematicsTool()
    tool.set_model_file(calibrated)
    tool.set_orientations_file(orientations)
    tool.set_sensor_to_opensim_rotations(opensim.Vec3(*_TO_OPENSIM))
    tool.set_time_range(0, float(start))
    tool.set_time_range(1, float(end))
    tool.set_results_directory(str(out))
    tool.set_output_motion_file("ik.mot")
    begin = time.perf_counter(), time.process_time()
    tool.run(False)
    seconds = {"wall": time.perf_counter() - begin[0], "cpu": time.process_time() - begin[1]}
    (out / "seconds.json").write_text(json.dumps(seconds))


if __name__ == "__main__":
    {"kinematics": kinematics, "ik": ik}[sys.argv[1]](*sys.argv[2:])
