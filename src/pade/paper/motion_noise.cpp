#include "pade/paper/motion_noise.hpp"

#include "pade/core/random.hpp"

namespace pade::evaluation {

RelativeMotion with_noise(const RelativeMotion& motion, const MotionNoise& noise, Measured measured,
                          std::uint64_t seed) {
  if (noise.level == 0) return motion;
  Random random(seed);
  const auto disturb = [&](const Eigen::Vector3d& value, double sigma) {
    Eigen::Vector3d result;
    for (int i = 0; i < 3; ++i) {
      result[i] = noise.model == NoiseModel::multiplicative
                      ? value[i] * (1 + random.uniform(-noise.level, noise.level))
                      : value[i] + sigma * noise.level * random.normal();
    }
    return result;
  };
  RelativeMotion noisy = motion;
  const Eigen::Vector3d translation = disturb(motion.t_reference_other, additive_translation);
  if (measured == Measured::motion) noisy.t_reference_other = translation;
  noisy.t_reference_other.z() = translation.z();
  if (measured == Measured::speed_alone) return noisy;
  noisy.R_reference_other =
      rotation_exp(disturb(motion.rotation_vector(), additive_rotation)).toRotationMatrix();
  return noisy;
}

PoseNoise pose_noise(const RelativeMotion& motion, const MotionNoise& noise) {
  if (noise.model == NoiseModel::multiplicative) return uniform_noise(motion, noise.level);
  return {Eigen::Vector3d::Constant(additive_translation * noise.level),
          Eigen::Vector3d::Constant(additive_rotation * noise.level)};
}

}  // namespace pade::evaluation
