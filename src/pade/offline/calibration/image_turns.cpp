#include "pade/offline/calibration/image_turns.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include <Eigen/Cholesky>
#include <opencv2/imgproc.hpp>

#include "pade/core/compute/median.hpp"
#include "pade/depth/derotation.hpp"
#include "pade/flow/methods/clg.hpp"

namespace pade {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Match = depth::MotionRefiner::Match;

constexpr int kLargestWidth = 800;        // px
constexpr int kTurnCells = 20;            // across the image, each of which gives its best pixel
constexpr int kTurnBlocks = 6;            // across the image, whose errors are independent
constexpr std::size_t kFewestTold = 50;   // pixels
constexpr double kTurnSigma = 0.03;       // rad: how wrong the first rotation may be
constexpr double kExpectedSigma = 0.004;  // rad: how wrong an expected one may be
constexpr double kAroundSigma = 0.4;      // rad, of each direction that is tried
constexpr double kFarSigma = 0.2;         // of the length, which is arbitrary
constexpr double kOtherWay = 0.5;         // rad between directions that are tried one after the other
constexpr double kTurnInflation = 2;      // of variances, as MotionRefinementOptions has it
constexpr double kTurnFloor = 1.2e-5;     // rad, the same
constexpr double kLargestTurn = 0.35;     // rad from one image to the next

/// The pixel of `ray` turned by R, relative to that of the match.
Vector2d displacement(const Camera& camera, const Match& match, const Matrix3d& R) {
  const Vector3d b = R * match.ray;
  return {camera.fx * b.x() / b.z() - match.p.x(), camera.fy * b.y() / b.z() - match.p.y()};
}

/// Its derivative by θ in exp(θ) R.
Eigen::Matrix<double, 2, 3> by_turn(const Camera& camera, const Match& match, const Matrix3d& R) {
  const Vector3d b = R * match.ray;
  const double x = b.x() / b.z();
  const double y = b.y() / b.z();
  Eigen::Matrix<double, 2, 3> J;
  J << -camera.fx * x * y, camera.fx * (1 + x * x), -camera.fx * y,  //
      -camera.fy * (1 + y * y), camera.fy * x * y, camera.fy * x;
  return J;
}

double tukey(double residual, double sigma) {
  const double u = residual / (tukey_reach * sigma);
  return std::abs(u) < 1 ? (1 - u * u) * (1 - u * u) : 0;
}

RelativeMotion prior_toward(const Vector3d& direction, const Matrix3d& R, double sigma) {
  RelativeMotion motion;
  motion.R_reference_other = R;
  motion.t_reference_other = direction;  // one metre: what is nearer than half of one is left out
  const Matrix3d along = direction * direction.transpose();
  motion.covariance.topLeftCorner<3, 3>() =
      kAroundSigma * kAroundSigma * (Matrix3d::Identity() - along) + kFarSigma * kFarSigma * along;
  motion.covariance.bottomRightCorner<3, 3>() = sigma * sigma * Matrix3d::Identity();
  return motion;
}

}  // namespace

/// A rotation that fits the matches, with or without a direction of translation.
struct TurnMeter::Fit {
  Matrix3d R = Matrix3d::Identity();  ///< R_newest_older
  Vector3d direction = Vector3d::Zero();
  Matrix3d covariance = Matrix3d::Zero();
  double sigma = std::numeric_limits<double>::infinity();  ///< robust spread of what is left, px
};

TurnMeter::TurnMeter(const Camera& camera, const cv::Mat& valid)
    : camera_(camera), refiner_(depth::MotionRefinementOptions{}) {
  cv::Mat mask = valid;
  while (camera_.width > kLargestWidth) {
    ++halvings_;
    camera_.width /= 2;
    camera_.height /= 2;
    camera_.fx /= 2;
    camera_.fy /= 2;
    camera_.cx = (camera_.cx + 0.5) / 2 - 0.5;
    camera_.cy = (camera_.cy + 0.5) / 2 - 0.5;
  }
  if (!mask.empty() && halvings_ > 0) cv::resize(mask, mask, camera_.size(), 0, 0, cv::INTER_NEAREST);
  flow::ClgOptions guide = flow::clg_guide_options();
  guide.pyramid.confidence = flow::FlowConfidence::local;
  flow_ = flow::make_clg(guide, "clg-guide");
  flow_->set_mask(mask);
  if (!mask.empty()) gate_ = mask == 0;
}

void TurnMeter::restart() {
  last_.release();
  rate_.setZero();
}

void TurnMeter::select(const FlowField& flow, const Matrix3d& R_removed) {
  matches_.clear();
  const int rows = std::max(1, kTurnCells * camera_.height / camera_.width);
  const Matrix3d back = R_removed.transpose();
  constexpr int kStep = 3;
  for (int cell = 0; cell < rows * kTurnCells; ++cell) {
    const int row = cell / kTurnCells;
    const int column = cell % kTurnCells;
    float best = std::numeric_limits<float>::infinity();
    int at_u = -1, at_v = -1;
    for (int v = row * camera_.height / rows; v < (row + 1) * camera_.height / rows; v += kStep) {
      for (int u = column * camera_.width / kTurnCells; u < (column + 1) * camera_.width / kTurnCells;
           u += kStep) {
        if (!gate_.empty() && gate_.at<std::uint8_t>(v, u) != 0) continue;
        const float sigma = flow.sigma.at<float>(v, u);
        const auto& w = flow.vectors.at<cv::Vec2f>(v, u);
        if (!(sigma < best) || !std::isfinite(w[0]) || !std::isfinite(w[1])) continue;
        best = sigma;
        at_u = u;
        at_v = v;
      }
    }
    if (at_u < 0) continue;
    const auto& w = flow.vectors.at<cv::Vec2f>(at_v, at_u);
    Match match;
    match.p = {at_u - camera_.cx, at_v - camera_.cy};
    match.ray = back * Vector3d((match.p.x() + static_cast<double>(w[0])) / camera_.fx,
                                (match.p.y() + static_cast<double>(w[1])) / camera_.fy, 1);
    if (!(match.ray.z() > 0)) continue;
    match.sigma = 1;
    match.block = row * kTurnBlocks / rows * kTurnBlocks + column * kTurnBlocks / kTurnCells;
    matches_.push_back(match);
  }
}

/// The rotation alone: robust least squares on the displacements.
TurnMeter::Fit TurnMeter::turn_alone(const Matrix3d& R) const {
  Fit fit;
  fit.R = R;
  std::vector<double> sizes;
  for (int iteration = 0; iteration < 12; ++iteration) {
    sizes.clear();
    for (const Match& match : matches_) {
      const Vector2d D = displacement(camera_, match, fit.R);
      sizes.push_back(std::abs(D.x()));
      sizes.push_back(std::abs(D.y()));
    }
    fit.sigma = std::max(0.02, median_to_sigma * median(sizes));
    Matrix3d information = Matrix3d::Zero();
    Vector3d gradient = Vector3d::Zero();
    Eigen::Matrix<double, 3, kTurnBlocks* kTurnBlocks> of_blocks =
        Eigen::Matrix<double, 3, kTurnBlocks * kTurnBlocks>::Zero();
    for (const Match& match : matches_) {
      const Vector2d D = displacement(camera_, match, fit.R);
      const auto J = by_turn(camera_, match, fit.R);
      const double weight = tukey(D.norm(), 1.5 * fit.sigma);
      information += weight * J.transpose() * J;
      gradient += weight * J.transpose() * D;
      of_blocks.col(match.block) += weight * J.transpose() * D;
    }
    const Eigen::LDLT<Matrix3d> solver(information + 1e-6 * Matrix3d::Identity());
    const Vector3d step = -solver.solve(gradient);
    if (!step.allFinite() || step.norm() > kLargestTurn) return {};
    fit.R = rotation_exp(step).toRotationMatrix() * fit.R;
    const Matrix3d inverse = solver.solve(Matrix3d::Identity());
    fit.covariance = kTurnInflation * inverse * of_blocks * of_blocks.transpose() * inverse;
    if (step.norm() < 1e-6) break;
  }
  return fit;
}

/// For each of thirteen directions (and their opposites) the rotation that leaves least across its lines (the
/// known one), best first.
std::vector<TurnMeter::Fit> TurnMeter::directions(const Fit& start, bool known) const {
  std::vector<Fit> fits;
  std::vector<double> sizes;
  for (int i = 14; i < 27; ++i) {
    Fit fit = start;
    fit.direction = Vector3d(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1).normalized();
    double ahead = 0;
    for (int iteration = known ? 4 : 0; iteration < 5; ++iteration) {
      sizes.clear();
      std::vector<depth::AcrossLine> lines;
      for (const Match& match : matches_) {
        lines.push_back(depth::across_line(camera_, fit.direction, fit.R, match));
        if (std::isfinite(lines.back().residual)) sizes.push_back(std::abs(lines.back().residual));
      }
      fit.sigma = std::max(0.02, median_to_sigma * median(sizes));
      Matrix3d information = Matrix3d::Zero();
      Vector3d gradient = Vector3d::Zero();
      ahead = 0;
      for (const depth::AcrossLine& line : lines) {
        if (!std::isfinite(line.residual)) continue;
        const double weight = tukey(line.residual, fit.sigma);
        information += weight * line.by_rotation.transpose() * line.by_rotation;
        gradient += weight * line.residual * line.by_rotation.transpose();
        ahead += weight * std::clamp(line.along, -3 * fit.sigma, 3 * fit.sigma);
      }
      const Vector3d step = -(information + 1e-6 * Matrix3d::Identity()).ldlt().solve(gradient);
      if (!step.allFinite() || step.norm() > kLargestTurn) break;
      if (iteration < 4) fit.R = rotation_exp(step).toRotationMatrix() * fit.R;
    }
    if (ahead < 0) fit.direction = -fit.direction;
    fits.push_back(fit);
  }
  std::sort(fits.begin(), fits.end(), [](const Fit& a, const Fit& b) { return a.sigma < b.sigma; });
  return fits;
}

std::optional<ImageTurn> TurnMeter::add(const cv::Mat& grey, Time stamp,
                                        const std::optional<Eigen::Quaterniond>& expected) {
  cv::Mat image = grey;
  if (halvings_ > 0) cv::resize(grey, image, camera_.size(), 0, 0, cv::INTER_AREA);
  const cv::Mat older = last_;
  const Time from = last_stamp_;
  last_ = image.clone();
  last_stamp_ = stamp;
  if (older.empty()) return std::nullopt;
  ++tally_.pairs;
  const double duration = seconds_between(from, stamp);
  RelativeMotion guess;
  guess.R_reference_other = expected ? Matrix3d(expected->conjugate().toRotationMatrix())
                                     : rotation_exp(Vector3d(rate_ * duration)).toRotationMatrix();
  const auto match = [&] {
    const cv::Mat seen = depth::derotate_image(older, camera_, guess);
    FlowField flow = flow_->estimate(last_, seen);
    select(flow, guess.R_reference_other);
    return flow;
  };
  FlowField flow = match();
  Fit alone = turn_alone(guess.R_reference_other);
  constexpr double kFarMoved = 6;  // px: what moves less is matched better
  const double moved =
      camera_.fx * rotation_log(Matrix3d(alone.R * guess.R_reference_other.transpose())).norm();
  if (!expected && matches_.size() >= kFewestTold && moved > kFarMoved && std::isfinite(alone.sigma)) {
    guess.R_reference_other = alone.R;
    flow = match();
    alone = turn_alone(guess.R_reference_other);
  }
  if (matches_.size() < kFewestTold || !std::isfinite(alone.sigma)) {
    ++tally_.blank;
    rate_.setZero();
    return std::nullopt;
  }
  const auto turned = [&](const Matrix3d& R, const Matrix3d& covariance) {
    rate_ = rotation_log(R) / duration;
    return ImageTurn{
        from, stamp, Eigen::Quaterniond(R.transpose()).normalized(),
        0.5 * (covariance + covariance.transpose()) + kTurnFloor * kTurnFloor * Matrix3d::Identity()};
  };
  Fit start = alone;
  if (expected) start.R = guess.R_reference_other;
  const std::vector<Fit> fits = directions(start, expected.has_value());
  const double sigma = expected ? kExpectedSigma : kTurnSigma;
  struct Told {
    Matrix3d R, covariance;
    double flow_sigma;
  };
  std::vector<Told> told;
  bool contradicted = false;
  constexpr std::size_t kTried = 3;
  for (std::size_t i = 0, tried = 0; i < fits.size() && tried < kTried; ++i) {
    const bool other =
        std::all_of(fits.begin(), fits.begin() + static_cast<std::ptrdiff_t>(i),
                    [&](const Fit& f) { return f.direction.dot(fits[i].direction) < std::cos(kOtherWay); });
    if (!other) continue;
    ++tried;
    const RelativeMotion prior = prior_toward(fits[i].direction, fits[i].R, sigma);
    const depth::RefinedMotion refined =
        refiner_.refine({camera_, prior, flow, guess.R_reference_other, last_, gate_});
    if (refined.outcome == depth::RefinementOutcome::hover) break;
    contradicted = contradicted || refined.outcome == depth::RefinementOutcome::inconsistent;
    if (refined.outcome != depth::RefinementOutcome::refined || refined.images.information.isZero(0))
      continue;
    // What is left of the rotation's information where the direction is unknown (Schur's complement).
    const Matrix6d& H = refined.images.information;
    const Matrix3d of_direction = H.topLeftCorner<3, 3>() + 1e-3 * Matrix3d::Identity();
    const Matrix3d information =
        H.bottomRightCorner<3, 3>() -
        H.bottomLeftCorner<3, 3>() * of_direction.ldlt().solve(H.topRightCorner<3, 3>());
    const Matrix3d covariance = (information + 1 / (sigma * sigma) * Matrix3d::Identity()).inverse();
    if (!covariance.allFinite()) continue;
    told.push_back({refined.images.R_reference_other, covariance, refined.flow_sigma});
    if (expected) break;
  }
  if (!told.empty()) {
    // Of motions that explain the flow alike (a plane has two) the one with the least turn.
    constexpr double kAlikeFlow = 1.3, kAlikePixels = 0.02;
    double least = told[0].flow_sigma;
    for (const Told& one : told) least = std::min(least, one.flow_sigma);
    const Told* best = nullptr;
    for (const Told& one : told) {
      if (one.flow_sigma > kAlikeFlow * least + kAlikePixels) continue;
      if (best == nullptr || rotation_log(one.R).norm() < rotation_log(best->R).norm()) best = &one;
    }
    ++tally_.moving;
    return turned(best->R, best->covariance);
  }
  // Without parallax the rotation explains all but the flow's noise.
  constexpr double kStillSigma = 0.5;  // px
  if (alone.sigma < kStillSigma) {
    ++tally_.still;
    const double hidden = alone.sigma / camera_.fx;  // by a translation that nobody sees
    return turned(alone.R, alone.covariance + hidden * hidden * Matrix3d::Identity());
  }
  ++(contradicted ? tally_.contradicted : tally_.blank);
  rate_ = rotation_log(alone.R) / duration;
  return std::nullopt;
}

}  // namespace pade
