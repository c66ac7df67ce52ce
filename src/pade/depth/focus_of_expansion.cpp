#include "pade/depth/focus_of_expansion.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Eigenvalues>
#include <Eigen/LU>

namespace pade::depth {
namespace {

constexpr std::size_t kFewest = 20;
constexpr int kIterations = 15;
constexpr double kMedianToSigma = 1.4826;
constexpr double kTukey = 4.685;  // 95 % efficiency on normal noise
constexpr double kLeastSigma = 1e-4;

Eigen::Vector2d normal_of(const FlowSample& s) { return Eigen::Vector2d(-s.flow.y(), s.flow.x()); }

/// Distance in px by which the end of each flow vector misses the line from e through its start.
double across(const FlowSample& s, const Eigen::Vector2d& e) {
  const Eigen::Vector2d arm = s.position - e;
  return normal_of(s).dot(arm) / std::max(arm.norm(), 1.0);
}

}  // namespace

std::optional<FocusOfExpansion> focus_of_expansion(const std::vector<FlowSample>& samples, double farthest) {
  if (samples.size() < kFewest) return std::nullopt;

  // Start: every vector weighs with its squared length, which needs no e.
  Eigen::Vector2d e = Eigen::Vector2d::Zero();
  Eigen::Matrix2d information = Eigen::Matrix2d::Zero();
  double sigma = 0;
  std::vector<double> residuals(samples.size());
  for (int iteration = 0; iteration <= kIterations; ++iteration) {
    if (iteration > 0) {
      std::transform(samples.begin(), samples.end(), residuals.begin(),
                     [&](const FlowSample& s) { return std::abs(across(s, e)); });
      const auto middle = residuals.begin() + static_cast<std::ptrdiff_t>(residuals.size() / 2);
      std::nth_element(residuals.begin(), middle, residuals.end());
      sigma = std::max(kLeastSigma, kMedianToSigma * *middle);
    }
    Eigen::Matrix2d sum = Eigen::Matrix2d::Zero();
    Eigen::Vector2d right = Eigen::Vector2d::Zero();
    for (const FlowSample& s : samples) {
      const Eigen::Vector2d n = normal_of(s);
      double weight = 1;
      if (iteration > 0) {
        const double r = across(s, e) / (kTukey * sigma);
        if (std::abs(r) >= 1) continue;
        weight = (1 - r * r) * (1 - r * r) / std::max((s.position - e).squaredNorm(), 1.0);
      }
      sum += weight * n * n.transpose();
      right += weight * n * n.dot(s.position);
    }
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> eigen(sum);
    // Parallel vectors: the smaller eigenvalue vanishes and the focus is at infinity.
    if (!(eigen.eigenvalues()(0) > 1e-9 * eigen.eigenvalues()(1))) return std::nullopt;
    const Eigen::Vector2d next = sum.inverse() * right;
    if (!next.allFinite()) return std::nullopt;
    const double step = (next - e).norm();
    e = next;
    information = sum;
    if (iteration > 1 && step < 1e-6 * (1 + e.norm())) break;
  }
  if (!(e.norm() <= farthest)) return std::nullopt;
  return FocusOfExpansion{e, sigma * sigma * information.inverse(), sigma};
}

}  // namespace pade::depth
