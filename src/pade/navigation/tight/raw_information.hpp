// Many scalar measurements of few variables, gated one by one and brought into the filter at once.
#pragma once

#include <array>
#include <cstdint>

#include "pade/navigation/tight/raw_models.hpp"

namespace pade::navigation {

enum class RawKind : std::uint8_t { range, rate, phase };

/// A measurement of one satellite, linearised.
struct RawEquation {
  RawKind kind = RawKind::range;
  std::size_t satellite = 0;  ///< its place in the epoch
  std::size_t anchored = 0;   ///< of a phase: its place among those at the anchor
  double residual = 0;        ///< measured less predicted
  double variance = 1;        ///< of the measurement
  RawRow row = RawRow::Zero();
  RawRow spread = RawRow::Zero();  ///< covariance of the variables times `row`
  bool used = true;
};

/// The measurements of an epoch.
struct RawEquations {
  std::array<RawEquation, 3 * kMostSatellites> all;
  std::size_t size = 0;

  [[nodiscard]] auto begin() { return all.begin(); }
  [[nodiscard]] auto end() { return all.begin() + static_cast<std::ptrdiff_t>(size); }
  [[nodiscard]] auto begin() const { return all.begin(); }
  [[nodiscard]] auto end() const { return all.begin() + static_cast<std::ptrdiff_t>(size); }
  RawEquation& add() { return all.at(size++); }
  /// How many of a kind there are, or are used.
  [[nodiscard]] std::size_t count(RawKind kind, bool used_only) const;
};

/// Whether most of the measurements of a kind, of five at least, are not used: it is then the filter that is
/// wrong.
[[nodiscard]] bool most_refused(const RawEquations& equations, RawKind kind);

/// The Kalman update of variables of prior covariance S by scalar measurements, one by one, in a form that
/// lifts to any state x with cov(x, variables) = C: x <- x + C mean, P <- P - C gain C^T.
struct RawInformation {
  RawMatrix gain = RawMatrix::Zero();
  RawRow mean = RawRow::Zero();

  void add(const RawEquation& equation);
  /// The residual that is left of a measurement that was added, over its own standard deviation; 0 if it is
  /// surely below `least`, or if nearly all of the measurement went into the variables.
  [[nodiscard]] double left_over(const RawEquation& equation, double least) const;
};

/// That of the measurements that are used; `spread` must be filled in.
RawInformation combined(const RawEquations& equations);

/// Marks those that do not fit as not used: first each one against the prior, then, while one is beyond the
/// gate given the prior and all others, the worst.
/// @param S  prior covariance of the variables; `spread` of the equations is filled in
RawInformation fit(RawEquations& equations, const RawMatrix& S, double gate);

}  // namespace pade::navigation
