#include "pade/navigation/gnss/least_squares.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>

namespace pade::gnss {
namespace {

/// Residuals, and each over its own σ: σ² less what the fit took of it, or plus what it adds.
void judge(std::span<Equation> equations, Estimate& estimate) {
  estimate.chi_square = 0;
  for (Equation& e : equations) {
    e.residual = e.value - e.coefficients.dot(estimate.x);
    const double fitted = e.coefficients.dot(estimate.covariance * e.coefficients);
    const double own = e.sigma * e.sigma;
    // An equation that alone carries an unknown has no residual that could tell anything.
    const double variance = e.used ? own - fitted : own + fitted;
    e.normalised = variance > 1e-6 * own ? e.residual / std::sqrt(variance) : 0;
    if (e.used) estimate.chi_square += e.residual * e.residual / own;
  }
}

}  // namespace

std::optional<Estimate> solve(std::span<Equation> equations) {
  UnknownsMatrix normal = UnknownsMatrix::Zero();
  Unknowns right = Unknowns::Zero();
  Estimate estimate;
  for (const Equation& e : equations) {
    if (!e.used) continue;
    const double weight = 1 / (e.sigma * e.sigma);
    normal.noalias() += weight * e.coefficients * e.coefficients.transpose();
    right += weight * e.value * e.coefficients;
    ++estimate.used;
  }
  int named = 0;
  // Scaled to ones on the diagonal, so that a pivot says how dependent its unknown is.
  Unknowns scale = Unknowns::Ones();
  Unknowns absent = Unknowns::Zero();
  for (int i = 0; i < kUnknowns; ++i) {
    if (normal(i, i) > 0) {
      scale[i] = 1 / std::sqrt(normal(i, i));
      ++named;
    } else {
      absent[i] = 1;
    }
  }
  estimate.redundancy = estimate.used - named;
  if (named == 0 || estimate.redundancy < 0 || !normal.allFinite() || !right.allFinite()) return std::nullopt;
  UnknownsMatrix scaled = scale.asDiagonal() * normal * scale.asDiagonal();
  scaled.diagonal() += absent;
  const Eigen::LDLT<UnknownsMatrix> factors(scaled);
  if (factors.info() != Eigen::Success || factors.vectorD().minCoeff() < 1e-10) return std::nullopt;
  UnknownsMatrix inverse = factors.solve(UnknownsMatrix::Identity());
  inverse.diagonal() -= absent;
  estimate.covariance = scale.asDiagonal() * inverse * scale.asDiagonal();
  estimate.x = estimate.covariance * right;
  judge(equations, estimate);
  return estimate;
}

std::optional<Estimate> solve_without_outliers(std::span<Equation> equations, double gate) {
  auto estimate = solve(equations);
  const int most = estimate ? estimate->used / 2 : 0;
  for (int removed = 0; estimate && removed < most && estimate->redundancy >= 2; ++removed) {
    const auto worst = std::max_element(equations.begin(), equations.end(), [](const auto& a, const auto& b) {
      return (a.used ? std::abs(a.normalised) : 0) < (b.used ? std::abs(b.normalised) : 0);
    });
    if (!worst->used || std::abs(worst->normalised) <= gate) break;
    worst->used = false;
    const auto without = solve(equations);
    if (!without) {
      worst->used = true;
      break;
    }
    estimate = without;
  }
  if (estimate) {
    estimate->contradicted = std::any_of(equations.begin(), equations.end(), [&](const Equation& e) {
      return e.used && std::abs(e.normalised) > gate;
    });
  }
  return estimate;
}

}  // namespace pade::gnss
