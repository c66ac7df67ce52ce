"""Navigation alone: a vehicle stands for three seconds, then accelerates eastwards at 1 m/s^2. IMU and GNSS go in, poses and the
motion of its camera between two image times come out.
"""

import numpy as np

import pade


def main():
    navigator = pade.Navigator(imu="industrial")
    covariance = 0.05**2 * np.eye(3)
    for i in range(1401):  # 7 s of a 200 Hz IMU
        now, moving = i / 200, max(0.0, i / 200 - 3)
        navigator.add_imu(now, angular_rate=[0, 0, 0], specific_force=[float(moving > 0), 0, 9.80665])  # forward, left, up
        if i == 200:
            navigator.add_heading(now, yaw=0, sigma=0.02)  # it looks east
        if i % 40 == 0:  # 5 Hz GNSS: east, north, up
            navigator.add_gnss_position(now, [0.5 * moving**2, 0, 0], covariance)
            navigator.add_gnss_velocity(now, [moving, 0, 0], covariance)

    body = navigator.absolute_pose(6.0)
    sigma = np.sqrt(np.diag(body.covariance)[6:])
    print(f"{navigator.health()['status']}: east {body.T_world_body.translation[0]:.3f} m, sigma {sigma[0]:.3f} m")

    T_body_camera = pade.forward_camera(lever_arm=[0.1, 0, 0])
    answer = navigator.relative_pose(6.0, 6.1, T_body_camera)
    if not answer.valid:
        raise SystemExit(f"no answer: {answer.answer}")
    along = answer.motion.translation[2]
    print(f"the camera moved {along:.3f} m along its axis, standard deviation {np.sqrt(answer.motion.covariance[2, 2]):.3f} m")
    return along


if __name__ == "__main__":
    main()
