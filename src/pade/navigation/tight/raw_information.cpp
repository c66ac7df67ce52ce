#include "pade/navigation/tight/raw_information.hpp"

#include <algorithm>
#include <cmath>

namespace pade::navigation {

std::size_t RawEquations::count(RawKind kind, bool used_only) const {
  return static_cast<std::size_t>(std::count_if(
      begin(), end(), [&](const RawEquation& e) { return e.kind == kind && (e.used || !used_only); }));
}

void RawInformation::add(const RawEquation& e) {
  RawRow direction = e.row;
  direction.noalias() -= gain * e.spread;
  const double weight = 1 / (e.spread.dot(direction) + e.variance);
  mean += (e.residual - e.spread.dot(mean)) * weight * direction;
  gain.noalias() += (weight * direction) * direction.transpose();
}

double RawInformation::left_over(const RawEquation& e) const {
  RawRow direction = e.row;
  direction.noalias() -= gain * e.spread;
  // One that alone tells of a variable has no residual that could tell anything.
  const double variance = e.variance - e.spread.dot(direction);
  return variance > 1e-6 * e.variance ? std::abs(e.residual - e.spread.dot(mean)) / std::sqrt(variance) : 0;
}

RawInformation combined(const RawEquations& equations) {
  RawInformation information;
  for (const RawEquation& e : equations) {
    if (e.used) information.add(e);
  }
  return information;
}

RawInformation fit(RawEquations& equations, const RawMatrix& S, double gate) {
  std::size_t used = 0;
  for (RawEquation& e : equations) {
    e.spread.noalias() = S * e.row;
    const double predicted = e.spread.dot(e.row) + e.variance;
    e.used = e.residual * e.residual <= gate * gate * predicted;
    used += e.used ? 1 : 0;
  }
  const std::size_t most = used / 3;
  for (std::size_t removed = 0;; ++removed) {
    const RawInformation information = combined(equations);
    if (removed == most) return information;
    RawEquation* worst = nullptr;
    double largest = gate;
    for (RawEquation& e : equations) {
      if (!e.used) continue;
      const double size = information.left_over(e);
      if (size <= largest) continue;
      largest = size;
      worst = &e;
    }
    if (worst == nullptr) return information;
    worst->used = false;
  }
}

}  // namespace pade::navigation
