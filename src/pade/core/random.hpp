// Random numbers that are the same on every machine: the standard fixes the engines, but not the
// distributions.
#pragma once

#include <cmath>
#include <cstdint>
#include <numbers>
#include <random>

#include <Eigen/Core>

namespace pade {

/// A seeded stream of uniform and normal numbers.
///
/// The order of the draws is part of the code. C++ leaves open in which order the arguments of a call and the
/// operands of an expression are evaluated, and another order makes another world from the same seed. Draws
/// therefore stand in statements of their own, or side by side in one braced list, which is evaluated from
/// left to right.
class Random {
 public:
  explicit Random(std::uint64_t seed) : engine_(seed) {}

  /// Uniform in [0, 1), 53 bits.
  double uniform() { return static_cast<double>(engine_() >> 11) * 0x1.0p-53; }
  double uniform(double low, double high) { return low + (high - low) * uniform(); }

  /// Standard normal (Box and Muller; one of the pair is dropped, so that the stream has no hidden state).
  double normal() {
    const double radius = std::sqrt(-2 * std::log(1 - uniform()));
    return radius * std::cos(2 * std::numbers::pi * uniform());
  }

  /// Uniform in the box between two corners, drawn in the order z, y, x.
  Eigen::Vector3d uniform_zyx(const Eigen::Vector3d& low, const Eigen::Vector3d& high) {
    Eigen::Vector3d value;
    for (int i = 2; i >= 0; --i) value[i] = uniform(low[i], high[i]);
    return value;
  }

  /// Three independent standard normals, drawn in the order x, y, z.
  Eigen::Vector3d normal3() {
    Eigen::Vector3d value;
    for (int i = 0; i < 3; ++i) value[i] = normal();
    return value;
  }

 private:
  std::mt19937_64 engine_;
};

}  // namespace pade
