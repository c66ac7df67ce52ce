// What of the paper reproduces: a verdict on each claim of its abstract, Sections 3.1 to 3.3 and 5, from the
// errors and times of our own runs. Claims are given in our words with the place where the paper makes them.
#pragma once

#include <array>
#include <limits>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "pade/evaluation/bootstrap.hpp"

namespace pade::evaluation {

/// A figure for each of the paper's ranges of true depth: 0-4, 4-8, 8-12, 12-16 m. NaN = there is none.
using PaperRanges = std::array<double, 4>;
inline constexpr double no_figure = std::numeric_limits<double>::quiet_NaN();
inline constexpr PaperRanges no_figures = {no_figure, no_figure, no_figure, no_figure};

/// Mean absolute depth error of a method over the pixels of one sequence, metres.
struct MethodErrors {
  PaperRanges all = no_figures;     ///< pixels that it answers
  PaperRanges common = no_figures;  ///< pixels that both TTC and PADE answer
};

/// Which measurement the noise is added to.
enum class NoiseOn {
  motion,    ///< the whole motion, as in the paper: TTC: v_z and omega; PADE: t and omega
  velocity,  ///< v_z of TTC alone, to see what its speed costs
};

/// The errors of both methods on one sequence with one flow and one level of noise, the mean over the draws.
/// The errors of a method that has no answer (TTC where the flight is sideways or vertical) are NaN.
struct ErrorRow {
  std::string sequence;
  std::string flow;  ///< as the program names it
  double noise = 0;  ///< 0.2 = 20 %; 0 = clean
  NoiseOn noise_on = NoiseOn::motion;
  MethodErrors ttc, pade;
};

/// Time per frame on one core, milliseconds: the mean over one sequence.
struct TimeRow {
  std::string sequence;
  std::string flow;
  double flow_ms = no_figure;
  double ttc_ms = no_figure;   ///< TTC alone, without the flow
  double pade_ms = no_figure;  ///< PADE alone, without the flow
};

/// Which of our flows stand for the paper's, and its largest noise.
struct VerdictOptions {
  std::string clg = "clg-fast";
  std::string farneback = "farneback";
  std::string lucas_kanade = "lucas-kanade";
  double noise = 0.2;
};

enum class Outcome { reproduces, in_part, does_not, not_tested };
/// "reproduces", "in part", "does not", "not tested".
std::string_view outcome_name(Outcome outcome);

/// Our verdict on one claim.
struct Verdict {
  std::string claim;  ///< in our words
  std::string where;  ///< in the paper: "abstract, 3.2"
  Outcome outcome = Outcome::not_tested;
  std::string sense;    ///< what was measured, with figures
  std::string measure;  ///< what the interval is of, with unit; empty if nothing was measured
  Interval interval;    ///< the claim's main figure over sequences, 95 %
};

/// Fewer sequences than this have no 95 % interval (the chance that five lie on one side is 2 / 32), and give
/// no verdict.
inline constexpr int fewest_sequences = 6;

/// Verdicts on the claims about accuracy and noise. A claim reproduces if the 95 % bootstrap interval over
/// sequences excludes zero in its favour, or, for a claim of sameness or size, lies within the stated margin:
/// in all ranges, flows and sets of pixels that it speaks of (pixels where both methods answer, and all). In
/// part: in some of them. Sequences of which a figure is missing are left out of its interval.
std::vector<Verdict> judge_accuracy(std::span<const ErrorRow> rows, const VerdictOptions& options = {});

/// Verdicts on the claims about time. They depend on the machine and belong beside the other times.
std::vector<Verdict> judge_speed(std::span<const TimeRow> rows, const VerdictOptions& options = {});

/// TTC's error less PADE's, metres: positive if PADE is ahead. One for each flow and level of noise, in
/// the order of the rows.
struct Comparison {
  std::string flow;
  double noise = 0;
  std::array<Interval, 4> common, all;  ///< per range of the paper
};
std::vector<Comparison> compare_methods(std::span<const ErrorRow> rows);

/// A claim whose outcome changes when something is switched, as an erratum.
struct OutcomeChange {
  std::string claim;
  Outcome before = Outcome::not_tested;
  Outcome after = Outcome::not_tested;
};
/// The claims that both have, with different outcomes.
std::vector<OutcomeChange> changed_outcomes(std::span<const Verdict> before, std::span<const Verdict> after);

/// An array of objects; NaN is null.
nlohmann::ordered_json json_of(std::span<const Verdict> verdicts);

}  // namespace pade::evaluation
