#include "pade/depth/focus_of_expansion.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/Eigenvalues>
#include <Eigen/LU>

#include "pade/core/compute/median.hpp"
#include "pade/core/random.hpp"

namespace pade::depth {
namespace {

constexpr std::size_t kFewestVectors = 20;
constexpr int kHypotheses = 100;
constexpr int kJudges = 100;
constexpr int kFocusIterations = 15;
constexpr double kLeastSigma = 1e-4;
constexpr double kRunaway = 10;  // times the farthest focus: there is no way back

Eigen::Vector2d normal_of(const FlowSample& s) { return Eigen::Vector2d(-s.flow.y(), s.flow.x()); }

/// Distance in px by which the end of each flow vector misses the line from e through its start.
double across(const FlowSample& s, const Eigen::Vector2d& e) {
  const Eigen::Vector2d arm = s.position - e;
  return normal_of(s).dot(arm) / std::max(arm.norm(), 1.0);
}

/// The intersection of two flow vectors that most vectors agree with (least median): a start that neither
/// moving objects nor the direction of the motion can mislead. Empty where all vectors are parallel or zero.
std::optional<Eigen::Vector2d> best_intersection(const std::vector<FlowSample>& samples) {
  Random random(1);
  const auto draw = [&]() -> const FlowSample& {
    return samples[static_cast<std::size_t>(random.uniform() * static_cast<double>(samples.size()))];
  };
  std::vector<FlowSample> judges;
  for (int i = 0; i < kJudges; ++i) judges.push_back(draw());

  std::optional<Eigen::Vector2d> best;
  double least = std::numeric_limits<double>::infinity();
  std::vector<double> residuals(judges.size());
  for (int i = 0; i < kHypotheses; ++i) {
    const FlowSample& a = draw();
    const FlowSample& b = draw();
    const double cross = a.flow.x() * b.flow.y() - a.flow.y() * b.flow.x();
    const Eigen::Vector2d between = b.position - a.position;
    const Eigen::Vector2d e =
        a.position + (between.x() * b.flow.y() - between.y() * b.flow.x()) / cross * a.flow;
    if (!e.allFinite()) continue;
    std::transform(judges.begin(), judges.end(), residuals.begin(),
                   [&](const FlowSample& s) { return std::abs(across(s, e)); });
    const double score = median(residuals);
    if (score < least) {
      least = score;
      best = e;
    }
  }
  return best;
}

/// Parallel vectors: the smaller eigenvalue vanishes and the focus is at infinity.
bool is_singular(const Eigen::Matrix2d& information) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> eigen(information, Eigen::EigenvaluesOnly);
  return !(eigen.eigenvalues()(0) > 1e-9 * eigen.eigenvalues()(1));
}

}  // namespace

std::optional<FocusOfExpansion> focus_of_expansion(const std::vector<FlowSample>& samples, double farthest) {
  if (samples.size() < kFewestVectors) return std::nullopt;

  const auto start = best_intersection(samples);
  if (!start) return std::nullopt;
  Eigen::Vector2d e = *start;

  // Gauss-Newton on the end-point distances across(s, e). Their derivative by e has only the part of the
  // normal that is perpendicular to the arm p - e; with the whole normal the focus of noisy flow would be
  // drawn to the centre.
  Eigen::Matrix2d information;
  double sigma = 0;
  std::vector<double> residuals(samples.size());
  for (int iteration = 0; iteration < kFocusIterations; ++iteration) {
    std::transform(samples.begin(), samples.end(), residuals.begin(),
                   [&](const FlowSample& s) { return std::abs(across(s, e)); });
    sigma = std::max(kLeastSigma, median_to_sigma * median(residuals));

    information.setZero();
    Eigen::Vector2d right = Eigen::Vector2d::Zero();
    for (const FlowSample& s : samples) {
      const double residual = across(s, e);
      const double r = residual / (tukey_reach * sigma);
      if (std::abs(r) >= 1) continue;
      const Eigen::Vector2d arm = s.position - e;
      const double length = std::max(arm.norm(), 1.0);
      const Eigen::Vector2d n = normal_of(s);
      const Eigen::Vector2d gradient = (n - n.dot(arm) / (length * length) * arm) / length;
      const double weight = (1 - r * r) * (1 - r * r);
      information += weight * gradient * gradient.transpose();
      right += weight * gradient * residual;
    }
    if (is_singular(information)) return std::nullopt;
    const Eigen::Vector2d step = information.inverse() * right;
    e += step;
    if (!(e.norm() <= kRunaway * farthest)) return std::nullopt;
    if (step.norm() < 1e-6 * (1 + e.norm())) break;
  }
  if (!(e.norm() <= farthest)) return std::nullopt;
  return FocusOfExpansion{e, sigma * sigma * information.inverse(), sigma};
}

}  // namespace pade::depth
