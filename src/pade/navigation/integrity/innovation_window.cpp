#include "pade/navigation/integrity/innovation_window.hpp"

#include <algorithm>
#include <cmath>

namespace pade::navigation {
namespace {

constexpr double kShort = 1;      // s
constexpr double kLong = 4;       // s
constexpr double kUsual = 60;     // s, over which what is usual is learnt
constexpr double kLargest = 4.5;  // no innovation counts for more: an outlier is no drift
constexpr double kMostCorrelated = 0.9;

}  // namespace

void InnovationWindow::Sum::add(const Vector3d& white, double decay) {
  value = decay * value + white;
  variance = decay * decay * variance + 1;
}

void InnovationWindow::add(const Vector3d& white, Time now, bool learn) {
  const double norm = white.norm();
  if (!std::isfinite(norm)) return;
  const Vector3d bounded = norm > kLargest ? Vector3d(white * (kLargest / norm)) : white;
  const double dt = empty_ ? 0 : std::max(0.0, seconds_between(newest_, now));
  short_.add(bounded, std::exp(-dt / kShort));
  long_.add(bounded, std::exp(-dt / kLong));
  const double gain = empty_ ? 1 : 1 - std::exp(-dt / kShort);
  level_ += gain * (bounded.squaredNorm() - level_);
  if (learn) {
    const double decay = std::exp(-dt / kUsual);
    power_ = decay * power_ + bounded.squaredNorm();
    lagged_ = decay * lagged_ + bounded.dot(last_);
  }
  last_ = bounded;
  newest_ = now;
  empty_ = false;
}

double InnovationWindow::drift() const {
  // Neighbours of correlation ρ add up to (1 + ρ) / (1 - ρ) of the variance of white ones.
  const double correlation = std::clamp(power_ > 0 ? lagged_ / power_ : 0.0, 0.0, kMostCorrelated);
  return std::max(short_.drift(), long_.drift()) * (1 - correlation) / (1 + correlation);
}

void InnovationWindow::forget() {
  short_ = long_ = {};
  level_ = 0;
  last_.setZero();
  empty_ = true;
}

}  // namespace pade::navigation
