// Weighted least squares of few unknowns, which leaves out what does not fit.
#pragma once

#include <cstddef>
#include <optional>
#include <span>

#include <Eigen/Core>

namespace pade::gnss {

constexpr int kUnknowns = 7;  ///< three of place or motion, and one clock for each system

using Unknowns = Eigen::Matrix<double, kUnknowns, 1>;                ///< their values
using UnknownsMatrix = Eigen::Matrix<double, kUnknowns, kUnknowns>;  ///< their covariance

/// One linear equation, `coefficients · x = value`, and what became of it.
struct Equation {
  Unknowns coefficients = Unknowns::Zero();
  double value = 0;
  double sigma = 1;       ///< of `value`
  bool used = true;       ///< set to false if it does not fit
  double residual = 0;    ///< value less coefficients · x, also if it is not used
  double normalised = 0;  ///< the residual over its own σ; of one that is not used over that of a prediction
};

/// Those unknowns that no equation names are 0, with variance 0.
struct Estimate {
  Unknowns x = Unknowns::Zero();
  UnknownsMatrix covariance = UnknownsMatrix::Zero();
  int used = 0;           ///< equations
  int redundancy = 0;     ///< equations used less unknowns that they name
  double chi_square = 0;  ///< sum of (residual/σ)² of those used; `redundancy` is expected
  /// Of solve_without_outliers(): equations that are used still contradict each other, and no more can go.
  bool contradicted = false;
};

/// Solves the equations that are `used`. Empty if they are too few or (nearly) dependent.
std::optional<Estimate> solve(std::span<Equation> equations);

/// solve(), and while the largest normalised residual is beyond `gate` its equation is left out, up to half
/// of them, as long as two more remain than are needed.
std::optional<Estimate> solve_without_outliers(std::span<Equation> equations, double gate);

}  // namespace pade::gnss
