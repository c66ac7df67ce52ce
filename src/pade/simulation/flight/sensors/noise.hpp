// The two processes that sensor errors are made of, in discrete time but defined in continuous time, so that
// the statistics do not depend on the sampling rate.
#pragma once

#include <cmath>

#include <Eigen/Core>

#include "pade/core/random.hpp"

namespace pade::simulation {

/// Standard deviation of one sample of white noise of the given density (unit/sqrt(Hz)), averaged over `dt`.
inline double white_sigma(double density, double dt) { return density / std::sqrt(dt); }

/// First-order Gauss-Markov process of three axes: stationary standard deviation `sigma` per axis,
/// autocorrelation exp(-|lag| / correlation_time). An infinite or zero correlation time gives a constant.
class GaussMarkov3 {
 public:
  GaussMarkov3() = default;
  /// Starts in the stationary distribution.
  GaussMarkov3(const Eigen::Vector3d& sigma, double correlation_time, Random& random)
      : sigma_(sigma), correlation_time_(correlation_time), value_(sigma.cwiseProduct(random.normal3())) {}

  const Eigen::Vector3d& step(double dt, Random& random) {
    const double phi =
        correlation_time_ > 0 && std::isfinite(correlation_time_) ? std::exp(-dt / correlation_time_) : 1;
    value_ = phi * value_ + std::sqrt(1 - phi * phi) * sigma_.cwiseProduct(random.normal3());
    return value_;
  }
  [[nodiscard]] const Eigen::Vector3d& value() const { return value_; }

 private:
  Eigen::Vector3d sigma_ = Eigen::Vector3d::Zero();
  double correlation_time_ = 0;
  Eigen::Vector3d value_ = Eigen::Vector3d::Zero();
};

}  // namespace pade::simulation
