// How verdicts are reached: figures of single sequences, intervals over them, and what they add up to.
#pragma once

#include <functional>
#include <span>
#include <string>
#include <vector>

#include "pade/paper/verdicts/verdicts.hpp"

namespace pade::evaluation {

/// One interval that a claim stands or falls with.
struct Evidence {
  std::string label;  ///< "0-4 m, common pixels"
  Interval interval;
  bool favours = false;  ///< if the interval is in favour of the claim
  [[nodiscard]] bool known() const { return interval.count >= fewest_sequences; }
};

/// Reproduces if all evidence is known and in favour, in part if some is, not tested if none is
/// known.
Outcome outcome_of(std::span<const Evidence> evidence);

/// "0-4 m +0.12 [+0.03, +0.20]; ..." in the order of the evidence.
std::string text_of(std::span<const Evidence> evidence);

/// A verdict of the evidence; `measure` says what the intervals are of. Its interval is that of `main`.
Verdict judge(std::string claim, std::string where, std::string measure, std::span<const Evidence> evidence,
              const Interval& main);
/// The same with the first evidence as the main one.
Verdict judge(std::string claim, std::string where, std::string measure, std::span<const Evidence> evidence);

/// The mean of the finite ones; NaN if there are none.
double mean_of_known(std::span<const double> values);

}  // namespace pade::evaluation
