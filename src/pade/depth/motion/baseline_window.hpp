// Lengths of the last steps, as GPS/INS and images have them together: GPS/INS errs on each, the images know
// their ratios (docs/method.md, "Scale from a window").
#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>

#include "pade/core/pose.hpp"

namespace pade::depth {

/// Maximum-likelihood lengths of the steps of a window. With x_j the logarithm of that of step j, and x^_j
/// what it was believed to be before,
///   GPS/INS   x_j = log g_j                                          variance r_j
///   images    x_j - sum w_i x_i = log b_j - sum w_i x^_i             variance q_j
/// where b_j is the step in the units of the depth of the frame before, which are those of the baseline that
/// the depth came from: the steps i, each with its share w_i of their length. What leaves the window is
/// marginalised.
class BaselineWindow {
 public:
  /// @param steps  of the window, at least 1.
  explicit BaselineWindow(int steps) : most_(steps) {}

  /// What the images say of a step's length.
  struct Seen {
    double length;    ///< b, m, > 0
    double variance;  ///< of its logarithm, > 0
    int steps;        ///< just before this one, whose sum is the baseline of the depth; at least 1
  };
  /// How far what the images say of a step is from what GPS/INS says of it and of those before: the square of
  /// the difference of the logarithms over its variance. Zero where there is nothing to compare.
  [[nodiscard]] double surprise(const RelativeMotion& given, const Eigen::Vector3d& direction,
                                const Seen& seen) const;
  /// Takes a step in.
  /// @param given  its motion by GPS/INS, with covariance. @param direction  of its translation, of length 1,
  /// as the images have it. @param seen  empty = nothing
  /// @return what the lengths of the steps before are to be multiplied by, oldest first.
  std::vector<double> push(const RelativeMotion& given, const Eigen::Vector3d& direction,
                           const std::optional<Seen>& seen);
  /// Forgets all.
  void clear() { *this = BaselineWindow(most_); }
  /// Length of the newest step, m. @pre push() was called
  [[nodiscard]] double length() const;
  /// Variance of the logarithm of what all lengths have in common. As far as the lengths that GPS/INS gives
  /// scatter about the ratios of the images their errors are of each step, and shrink with the number of
  /// steps; the rest is taken for common to all. It is no more than what the images have handed on from the
  /// steps before: a vehicle that comes to hover keeps the scale that it had in flight. @pre push() was
  /// called
  [[nodiscard]] double variance() const { return common_; }

 private:
  void drop_oldest();
  [[nodiscard]] double of_the_window() const;
  int most_;
  Eigen::VectorXd x_;            // best log lengths, oldest first
  Eigen::MatrixXd information_;  // of x
  Eigen::VectorXd right_;        // information * x
  Eigen::VectorXd given_;        // log g
  Eigen::VectorXd variances_;    // r
  double past_scatter_ = 0;      // sum of (log g - x)^2 / r of the steps that have left, fading
  double past_steps_ = 0;        // their number, fading
  double common_ = 0;            // variance()
};

}  // namespace pade::depth
