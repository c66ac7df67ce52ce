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
