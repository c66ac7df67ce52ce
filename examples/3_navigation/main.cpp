// Navigation alone: a vehicle stands for three seconds, then accelerates eastwards at 1 m/s². IMU and GNSS go
// in, the motion of its camera between two image times comes out.
#include <algorithm>
#include <cmath>
#include <cstdio>

#include <pade/navigation/navigator.hpp>

int main() {
  pade::navigation::Navigator navigator({});
  for (int i = 0; i <= 1400; ++i) {  // 7 s of a 200 Hz IMU
    const pade::Time now = pade::Time::from_seconds(i / 200.0);
    const double moving = std::max(0.0, i / 200.0 - 3);
    const double acceleration = moving > 0 ? 1 : 0;
    navigator.add(pade::ImuSample{now, {0, 0, 0}, {acceleration, 0, 9.80665}});  // body: forward, left, up
    if (i == 200) navigator.add(pade::Heading{now, 0, 0.02});                    // it looks east
    if (i % 40 != 0) continue;                                                   // 5 Hz GNSS, ENU
    const Eigen::Matrix3d covariance = 0.05 * 0.05 * Eigen::Matrix3d::Identity();
    navigator.add(pade::GnssFix{now, {0.5 * moving * moving, 0, 0}, covariance});
    navigator.add(pade::GnssVelocity{now, {moving, 0, 0}, covariance});
  }

  const pade::Pose T_body_camera{Eigen::Quaterniond(pade::forward_camera_rotation()), {0.1, 0, 0}};
  const pade::Time t1 = pade::Time::from_seconds(6.0);
  const pade::Time t2 = pade::Time::from_seconds(6.1);
  const auto answer = navigator.relative_pose(t1, t2, T_body_camera);
  if (answer.answer != pade::navigation::Answer::valid) return std::puts("no answer"), 1;
  const Eigen::Vector3d& t = answer.motion.t_reference_other;
  const double sigma = std::sqrt(answer.motion.covariance(2, 2));
  std::printf("the camera moved %.3f m along its axis, standard deviation %.3f m\n", t.z(), sigma);
  return std::abs(t.z() - 0.305) < 0.02 && answer.scale_valid ? 0 : 1;
}
