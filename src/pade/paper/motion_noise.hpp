// Errors of the position measurement as the paper adds them (Section 3.2, Figure 3). What "up to 20 %" means
// is not said there, so there are two readings, and every figure says which one it shows.
#pragma once

#include <cstdint>
#include <string_view>

#include "pade/core/options.hpp"
#include "pade/core/pose.hpp"
#include "pade/evaluation/cramer_rao.hpp"

namespace pade::evaluation {

enum class NoiseModel {
  multiplicative,  ///< each component times 1 + uniform in [-p, p): a component that is zero stays zero
  additive,        ///< each component plus normal noise: 0.2 m * p of translation, 1 degree * p of rotation
};

/// Noise of level p on each component of the motion between two frames.
struct MotionNoise {
  NoiseModel model = NoiseModel::multiplicative;
  double level = 0;  ///< p, 0.2 = 20 %

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& field) {
    field("noise", self.model, "multiplicative | additive noise of translation and rotation");
    field("level", self.level, "its level, 0.2 = 20 %");
  }
};

/// Standard deviations of the additive model at p = 1.
inline constexpr double additive_translation = 0.2;                        // m per axis
inline constexpr double additive_rotation = 3.14159265358979323846 / 180;  // rad per axis

/// What the method at hand measures with the GPS/INS.
enum class Measured {
  motion,         ///< PADE: translation and rotation
  forward_speed,  ///< TTC: the speed along the optical axis, and rotation
  speed_alone,    ///< only the speed along the optical axis, to see what it costs TTC
};

/// `motion` as a noisy position measurement has it: translation and rotation vector, in the axes of the
/// reference. The stream is that of `seed`; translation is drawn first in the order x, y, z, so that PADE and
/// TTC get the same t_z and rotation from the same seed. With forward_speed the other two
/// components stay, with speed_alone rotation as well.
RelativeMotion with_noise(const RelativeMotion& motion, const MotionNoise& noise, Measured measured,
                          std::uint64_t seed);

/// Its standard deviations.
PoseNoise pose_noise(const RelativeMotion& motion, const MotionNoise& noise);

}  // namespace pade::evaluation

template <>
struct pade::EnumNames<pade::evaluation::NoiseModel> {
  static constexpr std::array names = {
      std::pair{pade::evaluation::NoiseModel::multiplicative, std::string_view("multiplicative")},
      std::pair{pade::evaluation::NoiseModel::additive, std::string_view("additive")}};
};
