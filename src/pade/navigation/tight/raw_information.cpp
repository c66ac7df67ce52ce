#include "pade/navigation/tight/raw_information.hpp"

#include <algorithm>
#include <cmath>

namespace pade::navigation {
namespace {

// A measurement whose own residual is expected to be less than this share of its sigma alone tells of a
// variable: no residual of it could tell anything.
constexpr double kSmall = 0.4;

constexpr std::size_t kLeastJudges = 5;  // satellites whose majority can tell that the filter is wrong

/// M v, for a v that may have many zeros. Of this size a general product is three times as slow.
RawRow product(const RawMatrix& M, const RawRow& v) {
  RawRow sum = RawRow::Zero();
  for (int i = 0; i < kRawVariables; ++i) {
    if (v[i] != 0) sum += v[i] * M.col(i);
  }
  return sum;
}

}  // namespace

std::size_t RawEquations::count(RawKind kind, bool used_only) const {
  return static_cast<std::size_t>(std::count_if(
      begin(), end(), [&](const RawEquation& e) { return e.kind == kind && (e.used || !used_only); }));
}

bool most_refused(const RawEquations& equations, RawKind kind) {
  const std::size_t all = equations.count(kind, false);
  return all >= kLeastJudges && 2 * equations.count(kind, true) < all;
}

void RawInformation::add(const RawEquation& e) {
  const RawRow direction = e.row - product(gain, e.spread);
  const double weight = 1 / (e.spread.dot(direction) + e.variance);
  mean += (e.residual - e.spread.dot(mean)) * weight * direction;
  for (int i = 0; i < kRawVariables; ++i) gain.col(i) += weight * direction[i] * direction;
}

double RawInformation::left_over(const RawEquation& e, double least) const {
  const double residual = std::abs(e.residual - e.spread.dot(mean));
  if (residual * residual < kSmall * kSmall * least * least * e.variance) return 0;
  const RawRow direction = e.row - product(gain, e.spread);
  const double variance = e.variance - e.spread.dot(direction);
  return variance > kSmall * kSmall * e.variance ? residual / std::sqrt(variance) : 0;
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
    e.spread = product(S, e.row);
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
      const double size = information.left_over(e, gate);
      if (size <= largest) continue;
      largest = size;
      worst = &e;
    }
    if (worst == nullptr) return information;
    worst->used = false;
  }
}

}  // namespace pade::navigation
