#include "pade/depth/motion/motion_refinement.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

#include "pade/core/compute/median.hpp"

namespace pade::depth {
namespace {

constexpr int kFewestPixels = 50;
constexpr double kLeastInlierShare = 0.4;
constexpr int kIterations = 30;
constexpr int kBlocksAcross = 6;  // blocks of pixels whose errors count as independent of each other
constexpr int kBlocks = kBlocksAcross * kBlocksAcross;
constexpr double kStartCorrelation = 4;  // before it is known
constexpr double kNearestPixel = 0.5;    // m: no pixel is nearer
constexpr double kTypicalDepth = 8;      // m
constexpr double kSettled = 0.9;         // of the robust scale before
constexpr double kHoverParallax = 2;     // flow sigmas of median parallax
constexpr double kLargestSigma = 1.5;    // px across the lines: more is no noise
constexpr double kHoverDirection = 0.5;  // rad: a direction this uncertain is none
constexpr double kLargestSurprise = 40;  // chi-square of 6 degrees of freedom beyond 1 - 1e-6
constexpr double kValidDirection = 0.1;  // rad
constexpr double kLattice = 4;           // px between the candidates within a cell
constexpr double kDegree = std::numbers::pi / 180;

Eigen::Matrix3d cross_matrix(const Eigen::Vector3d& v) {
  Eigen::Matrix3d m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

/// The square root of a covariance by Cholesky's method: Sigma = S S^T, with a column of zeros wherever a
/// component is exact or follows from those before it.
Matrix6d square_root(const Matrix6d& covariance) {
  // Metres and radians differ in size: a correlation matrix shows what follows from what.
  constexpr double kFollows = 1e-10;
  const Vector6d sigma = covariance.diagonal().cwiseMax(0).cwiseSqrt();
  Matrix6d root = Matrix6d::Zero();
  for (int j = 0; j < 6; ++j) {
    if (!(sigma[j] > 0)) continue;
    const double left = 1 - root.row(j).squaredNorm();
    if (left < kFollows) continue;
    root(j, j) = std::sqrt(left);
    for (int i = j + 1; i < 6; ++i) {
      if (!(sigma[i] > 0)) continue;
      const double correlation = covariance(i, j) / (sigma[i] * sigma[j]);
      root(i, j) = (correlation - root.row(i).head(j).dot(root.row(j).head(j))) / root(j, j);
    }
  }
  return sigma.asDiagonal() * root;
}

/// Motions around the prior. A step (dt, dtheta) turns the baseline by the part of dt across it and stretches
/// it by the part along it, so that a change of direction is none of length.
struct Chart {
  const RelativeMotion& prior;
  double length = prior.t_reference_other.norm();
  Eigen::Vector3d direction = prior.t_reference_other / length;

  [[nodiscard]] Eigen::Matrix3d turn(const Vector6d& step) const {
    return rotation_exp(Eigen::Vector3d(direction.cross(step.head<3>()) / length)).toRotationMatrix();
  }
  [[nodiscard]] RelativeMotion at(const Vector6d& step) const {
    RelativeMotion moved = prior;
    moved.t_reference_other = (length + direction.dot(step.head<3>())) * (turn(step) * direction);
    moved.R_reference_other =
        rotation_exp(Eigen::Vector3d(step.tail<3>())).toRotationMatrix() * prior.R_reference_other;
    return moved;
  }
};

/// Sums over all matches at one motion, in units of the prior: z with (dt, dtheta) = S z, z ~ N(0, I).
struct Sums {
  Matrix6d information = Matrix6d::Zero();  // sum of w g g^T / sigma^2, without what noise alone adds to it
  Matrix6d variance = Matrix6d::Zero();     // of the gradient, if pixels were independent: with that
  Vector6d gradient = Vector6d::Zero();     // sum of w g r / sigma^2
  Matrix6d scatter = Matrix6d::Zero();      // of the gradients of blocks: their covariance
  double slope = 0;                         // mean slope of the robust function over the mean weight
  double flow_sigma = 0;                    // px
  double parallax = 0;                      // median, px
  int inliers = 0;
};

class Problem {
 public:
  Problem(const Camera& camera, const Chart& chart, const Matrix6d& root,
          const std::vector<MotionRefiner::Match>& matches, double least_sigma)
      : camera_(camera), chart_(chart), root_(root), matches_(matches), least_sigma_(least_sigma) {
    lines_.resize(matches.size());
  }

  Sums sums(const Vector6d& z, bool coarse) {
    const Vector6d step = root_ * z;
    Matrix6d turned = root_;
    turned.topRows<3>() = chart_.turn(step) * root_.topRows<3>();
    Sums out;
    measure(chart_.at(step), out);
    accumulate(turned, coarse, out);
    return out;
  }

 private:
  void measure(const RelativeMotion& motion, Sums& out) {
    residuals_.clear();
    parallaxes_.clear();
    for (std::size_t i = 0; i < matches_.size(); ++i) {
      lines_[i] = across_line(camera_, motion.t_reference_other, motion.R_reference_other, matches_[i]);
      if (!std::isfinite(lines_[i].residual)) continue;
      residuals_.push_back(std::abs(lines_[i].residual) / matches_[i].sigma);
      parallaxes_.push_back(std::abs(lines_[i].along));
    }
    if (residuals_.empty()) return;
    out.flow_sigma = std::max(least_sigma_, median_to_sigma * median(residuals_));
    out.parallax = median(parallaxes_);
  }

  void accumulate(const Matrix6d& root, bool coarse, Sums& out) const {
    Eigen::Matrix<double, 6, kBlocks> of_blocks = Eigen::Matrix<double, 6, kBlocks>::Zero();
    double slopes = 0;
    double weights = 0;
    for (std::size_t i = 0; i < matches_.size(); ++i) {
      const AcrossLine& line = lines_[i];
      if (!std::isfinite(line.residual)) continue;
      const double sigma = out.flow_sigma * matches_[i].sigma;
      const double u = line.residual / (tukey_reach * sigma);
      if (std::abs(u) >= 1) continue;
      if (!coarse && line.along < -tukey_reach * sigma) continue;  // behind the cameras
      // Near the epipole noise makes any inverse depth, along / length, and with it any derivative by t.
      if (std::abs(line.along) > line.length / kNearestPixel) continue;
      ++out.inliers;
      const double trusted = line.length * line.length;
      const double doubtful = std::pow(kTypicalDepth * sigma, 2);
      const double weight = (1 - u * u) * (1 - u * u) * trusted / (trusted + doubtful);
      weights += weight;
      slopes += (1 - u * u) * (1 - 5 * u * u);
      Vector6d g;
      g << line.by_translation.transpose(), line.by_rotation.transpose();
      const Vector6d in_z = root.transpose() * g / sigma;
      out.variance += weight * in_z * in_z.transpose();
      // The derivative by t has the pixel's parallax as a factor. Its noise adds to the square.
      const Vector6d by_noise = root.topRows<3>().transpose() * line.by_translation.transpose() / line.along;
      out.information += weight * (in_z * in_z.transpose() - by_noise * by_noise.transpose());
      of_blocks.col(matches_[i].block) += weight * line.residual / sigma * in_z;
    }
    for (int block = 0; block < kBlocks; ++block) out.gradient += of_blocks.col(block);
    for (int block = 0; block < kBlocks; ++block) {
      const Vector6d centred = of_blocks.col(block) - out.gradient / kBlocks;
      out.scatter += centred * centred.transpose();
    }
    out.scatter *= static_cast<double>(kBlocks) / (kBlocks - 1);
    out.slope = weights > 0 ? slopes / weights : 0;
  }

  const Camera& camera_;
  const Chart& chart_;
  const Matrix6d& root_;
  const std::vector<MotionRefiner::Match>& matches_;
  double least_sigma_;
  std::vector<AcrossLine> lines_;
  std::vector<double> residuals_, parallaxes_;
};

Matrix6d inverse(const Matrix6d& precision) { return precision.ldlt().solve(Matrix6d::Identity()); }

/// What the flow tells about z as one measurement. Where its noise alone makes a gradient, `information` is
/// (nearly) zero and `variance` is not: the weight of the gradient is information / variance.
struct Measurement {
  Matrix6d information;
  Vector6d gradient;
  double correlation;  // this many pixels count as one
};

/// Precision of the error that all pixels share.
Matrix6d precision_of_floor(const RelativeMotion& motion, const MotionRefinementOptions& options) {
  const double across = motion.t_reference_other.norm() * options.direction_floor_deg * kDegree;
  Vector6d sigma;
  sigma << Eigen::Vector3d::Constant(across), Eigen::Vector3d::Constant(options.rotation_floor_deg * kDegree);
  constexpr double kLeast = 1e-9;
  return sigma.cwiseMax(kLeast).cwiseAbs2().cwiseInverse().asDiagonal();
}

Measurement measurement(const Sums& sums, const Matrix6d& floor, double inflation, double correlation) {
  constexpr double kUnseen = 1e-6;  // in units of the prior: the length of the baseline
  const Matrix6d variance = sums.variance + kUnseen * Matrix6d::Identity();
  const Matrix6d ratio = variance.ldlt().solve(sums.information).transpose();
  // Smoothstep of the ratio: where most of the gradient is noise, the flow has no say.
  const Matrix6d square = ratio * ratio;
  const Matrix6d weight = (3 * square - 2 * square * ratio) * ratio;
  if (!(correlation > 0)) {
    // The scatter of the blocks' gradients over what independent pixels would have, where the flow has a say.
    const Matrix6d posterior = inverse(variance + Matrix6d::Identity());
    constexpr double kLeastSlopeOfScale = 0.3;
    const double slope = std::max(kLeastSlopeOfScale, sums.slope);
    const double expected = (posterior * sums.variance).trace();
    const double found = (posterior * sums.scatter).trace() / (slope * slope);
    correlation = inflation * (expected > 0 ? std::max(1.0, found / expected) : 1.0);
  }
  const Matrix6d own = weight * sums.information / correlation;
  // The error that all pixels share adds its covariance: (own^-1 + floor^-1)^-1 = floor (own + floor)^-1 own.
  const Matrix6d both = own + floor + kUnseen * Matrix6d::Identity();
  const Matrix6d share = both.transpose().ldlt().solve(floor).transpose();
  const Matrix6d information = share * own;
  return {0.5 * (information + information.transpose()), share * (weight * sums.gradient / correlation),
          correlation};
}

/// Of an error S e of the prior the solution shows S (I - posterior) e.
Eigen::Matrix3d turn_gain(const Matrix6d& root, const Matrix6d& posterior) {
  if (!(root.diagonal().minCoeff() > 0)) return Eigen::Matrix3d::Zero();  // partly exact
  const Matrix6d shown = root * (Matrix6d::Identity() - posterior);
  return root.transpose()
      .triangularView<Eigen::Upper>()
      .solve(shown.transpose())
      .transpose()
      .bottomRightCorner<3, 3>();
}

/// What the flow alone tells: its normal equations at the refined motion, in units of the prior, are turned
/// into those of direction and rotation, and solved without the prior.
ImageMotion images_alone(const Measurement& flow, const Matrix6d& root, const Eigen::Matrix3d& turned,
                         const RelativeMotion& refined) {
  constexpr double kUntold = 0.3;  // rad
  const double length = refined.t_reference_other.norm();
  if (!(root.diagonal().minCoeff() > 0) || !(length > 0)) return {};
  ImageMotion out;
  out.direction = refined.t_reference_other / length;
  // z = back (direction, rotation): z = S^-1 (dt, dtheta), dt turned back and of the baseline's length.
  Matrix6d across = Matrix6d::Identity();
  across.topLeftCorner<3, 3>() =
      length * turned.transpose() * (Eigen::Matrix3d::Identity() - out.direction * out.direction.transpose());
  const Matrix6d back = root.triangularView<Eigen::Lower>().solve(across);
  const Eigen::SelfAdjointEigenSolver<Matrix6d> parts(back.transpose() * flow.information * back);
  const Vector6d gradient = back.transpose() * flow.gradient;
  Vector6d step = Vector6d::Zero();
  for (int i = 0; i < 6; ++i) {
    const double told = parts.eigenvalues()[i];
    if (!(told * kUntold * kUntold > 1)) continue;
    const Vector6d axis = parts.eigenvectors().col(i);
    out.information += told * axis * axis.transpose();
    step -= axis * (axis.dot(gradient) / told);
  }
  out.R_reference_other =
      rotation_exp(Eigen::Vector3d(step.tail<3>())).toRotationMatrix() * refined.R_reference_other;
  out.direction = (out.direction + step.head<3>()).normalized();
  across.topLeftCorner<3, 3>() = Eigen::Matrix3d::Identity() - out.direction * out.direction.transpose();
  out.information = (across * out.information * across).eval();
  return out;
}

RefinedMotion unchanged(const RelativeMotion& prior, RefinementOutcome outcome, RefinedMotion so_far = {}) {
  so_far.motion = prior;
  so_far.outcome = outcome;
  state_length_and_direction(so_far);
  return so_far;
}

}  // namespace

void state_length_and_direction(RefinedMotion& out) {
  const Eigen::Vector3d& t = out.motion.t_reference_other;
  const double length = t.norm();
  const double infinite = std::numeric_limits<double>::infinity();
  out.length_sigma_relative = out.direction_sigma = infinite;
  out.direction_valid = false;
  if (!(length > 0)) return;
  const Eigen::Vector3d direction = t / length;
  const Eigen::Matrix3d covariance = out.motion.covariance.topLeftCorner<3, 3>();
  out.length_sigma_relative = std::sqrt(std::max(0.0, direction.dot(covariance * direction))) / length;
  const Eigen::Matrix3d across = Eigen::Matrix3d::Identity() - direction * direction.transpose();
  // The larger of the two eigenvalues that are not zero.
  const Eigen::Matrix3d projected = across * covariance * across;
  const double trace = projected.trace();
  const double spread = std::sqrt(std::max(0.0, 2 * projected.squaredNorm() - trace * trace));
  out.direction_sigma = std::sqrt(0.5 * (trace + spread)) / length;
  out.direction_valid = out.direction_sigma < kValidDirection;
}

AcrossLine across_line(const Camera& camera, const Eigen::Vector3d& t, const Eigen::Matrix3d& R,
                       const MotionRefiner::Match& match) {
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  AcrossLine line{kNone, kNone, 0, Eigen::RowVector3d::Zero(), Eigen::RowVector3d::Zero()};
  const Eigen::Vector3d b = R * match.ray;
  const Eigen::Vector2d a(-camera.fx * t.x() + match.p.x() * t.z(), -camera.fy * t.y() + match.p.y() * t.z());
  line.length = a.norm();
  if (!(b.z() > 0) || !(line.length > 0)) return line;
  const double x = b.x() / b.z();
  const double y = b.y() / b.z();
  const Eigen::Vector2d D(camera.fx * x - match.p.x(), camera.fy * y - match.p.y());
  const Eigen::Vector2d along = a / line.length;
  const Eigen::Vector2d across(-along.y(), along.x());
  line.residual = across.dot(D);
  line.along = along.dot(D);

  // d across = -along (across . da) / |a|, da = -A dt
  const double turn = line.along / line.length;
  line.by_translation =
      turn * Eigen::RowVector3d(across.x() * camera.fx, across.y() * camera.fy, -across.dot(match.p));
  // db = dtheta x b
  Eigen::Matrix<double, 2, 3> projection;
  projection << camera.fx, 0, -camera.fx * x, 0, camera.fy, -camera.fy * y;
  line.by_rotation = -across.transpose() * projection * cross_matrix(b) / b.z();
  return line;
}

void MotionRefiner::select(const RefinementInput& input) {
  matches_.clear();
  const Camera& camera = input.camera;
  const cv::Mat& vectors = input.flow.vectors;
  const bool fits = vectors.type() == CV_32FC2 && vectors.size() == camera.size();
  if (!fits) return;
  const bool has_sigma = input.flow.sigma.size() == camera.size() && input.flow.sigma.type() == CV_32FC1;
  const bool has_image = input.reference.size() == camera.size() && input.reference.type() == CV_8UC1;
  const bool has_gate = input.gate.size() == camera.size() && input.gate.type() == CV_8UC1;
  const double cell = std::max(
      kLattice, std::sqrt(static_cast<double>(camera.width) * camera.height / std::max(1, options_.pixels)));
  const int columns = std::max(1, static_cast<int>(camera.width / cell));
  const int rows = std::max(1, static_cast<int>(camera.height / cell));
  const int lattice = static_cast<int>(kLattice);
  const Eigen::Matrix3d back = input.R_removed.transpose();

  // Small is good: the flow's own sigma, else the inverse of the gradient.
  const auto badness = [&](int u, int v) -> double {
    if (has_gate && input.gate.at<std::uint8_t>(v, u) != 0) return NAN;
    const auto& w = vectors.at<cv::Vec2f>(v, u);
    if (!std::isfinite(w[0]) || !std::isfinite(w[1])) return NAN;
    if (has_sigma) return input.flow.sigma.at<float>(v, u);
    if (!has_image) return 1;
    if (u < 1 || v < 1 || u + 1 >= camera.width || v + 1 >= camera.height) return NAN;
    const auto grey = [&](int y, int x) {
      return static_cast<double>(input.reference.at<std::uint8_t>(y, x));
    };
    const double gx = grey(v, u + 1) - grey(v, u - 1);
    const double gy = grey(v + 1, u) - grey(v - 1, u);
    constexpr double kBlank = 10;
    const double gradient = std::hypot(gx, gy);
    return gradient < kBlank ? NAN : 1 / gradient;
  };

  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      double best = std::numeric_limits<double>::infinity();
      int at_u = -1;
      int at_v = -1;
      const int top = row * camera.height / rows;
      const int bottom = (row + 1) * camera.height / rows;
      const int left = column * camera.width / columns;
      const int right = (column + 1) * camera.width / columns;
      for (int v = top + lattice / 2; v < bottom; v += lattice) {
        for (int u = left + lattice / 2; u < right; u += lattice) {
          const double bad = badness(u, v);
          if (bad < best) {
            best = bad;
            at_u = u;
            at_v = v;
          }
        }
      }
      if (at_u < 0) continue;
      const auto& w = vectors.at<cv::Vec2f>(at_v, at_u);
      Match match;
      match.p = {at_u - camera.cx, at_v - camera.cy};
      match.ray = back * Eigen::Vector3d((match.p.x() + static_cast<double>(w[0])) / camera.fx,
                                         (match.p.y() + static_cast<double>(w[1])) / camera.fy, 1);
      const double to_u = camera.fx * match.ray.x() / match.ray.z() + camera.cx;
      const double to_v = camera.fy * match.ray.y() / match.ray.z() + camera.cy;
      const bool seen = match.ray.z() > 0 && to_u >= 0 && to_v >= 0 && to_u <= camera.width - 1 &&
                        to_v <= camera.height - 1;
      if (!seen) continue;
      match.sigma = has_sigma ? best : 1;
      match.block = row * kBlocksAcross / rows * kBlocksAcross + column * kBlocksAcross / columns;
      matches_.push_back(match);
    }
  }
  if (!has_sigma || matches_.empty()) return;
  // Sigmas in relation to the median one: the frame itself tells their common scale.
  std::vector<double> sigmas;
  for (const Match& match : matches_) sigmas.push_back(match.sigma);
  const double typical = median(sigmas);
  constexpr double kBestSigma = 0.5;
  for (Match& match : matches_) match.sigma = std::max(kBestSigma, match.sigma / typical);
}

RefinedMotion MotionRefiner::refine(const RefinementInput& input) {
  const RelativeMotion& prior = input.prior;
  if (!options_.on) return unchanged(prior, RefinementOutcome::off);
  if (prior.covariance.isZero(0)) return unchanged(prior, RefinementOutcome::exact_prior);
  if (!prior.covariance.allFinite()) return unchanged(prior, RefinementOutcome::degenerate);
  if (!(unchanged(prior, RefinementOutcome::off).direction_sigma < kHoverDirection)) {
    return unchanged(prior, RefinementOutcome::hover);
  }
  select(input);
  RefinedMotion out;
  out.pixels = static_cast<int>(matches_.size());
  if (out.pixels < kFewestPixels) return unchanged(prior, RefinementOutcome::too_few_pixels, out);

  const Chart chart{prior};
  const Matrix6d root = square_root(prior.covariance);
  const Matrix6d identity = Matrix6d::Identity();
  Problem problem(input.camera, chart, root, matches_, options_.least_sigma);

  // First the robust scale shrinks from the size of the prior's error to that of the flow's; only then is
  // noise told from information.
  Vector6d z = Vector6d::Zero();
  Sums sums;
  Measurement flow;
  const Matrix6d floor = root.transpose() * precision_of_floor(prior, options_) * root;
  bool coarse = true;
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    const double scale = sums.flow_sigma;
    sums = problem.sums(z, coarse);
    if (sums.inliers < kFewestPixels) return unchanged(prior, RefinementOutcome::too_few_pixels, out);
    if (coarse && iteration > 1 && sums.flow_sigma > kSettled * scale) coarse = false;
    if (coarse) sums.information = sums.variance;
    flow = measurement(sums, floor, options_.inflation, coarse ? kStartCorrelation : 0);
    const Vector6d step = -(flow.information + identity).ldlt().solve(flow.gradient + z);
    z += step;
    if (!z.allFinite()) return unchanged(prior, RefinementOutcome::degenerate, out);
    constexpr double kSmall = 1e-3;
    if (!coarse && step.norm() < kSmall) break;
  }
  sums = problem.sums(z, false);
  out.flow_sigma = sums.flow_sigma;
  out.correlation = flow.correlation;
  out.inlier_share = static_cast<double>(sums.inliers) / static_cast<double>(matches_.size());
  if (sums.inliers < kFewestPixels) return unchanged(prior, RefinementOutcome::too_few_pixels, out);
  if (sums.parallax < kHoverParallax * sums.flow_sigma) {
    const bool noisy = sums.flow_sigma > kLargestSigma;
    return unchanged(prior, noisy ? RefinementOutcome::inconsistent : RefinementOutcome::hover, out);
  }

  const Matrix6d posterior = inverse(flow.information + identity);
  out.surprise = z.squaredNorm();
  out.turn = (root * z).tail<3>();
  out.turn_gain = turn_gain(root, posterior);
  if (out.surprise > kLargestSurprise || out.inlier_share < kLeastInlierShare) {
    return unchanged(prior, RefinementOutcome::inconsistent, out);
  }
  const Vector6d step = root * z;
  out.motion = chart.at(step);
  Matrix6d turn = Matrix6d::Identity();
  turn.topLeftCorner<3, 3>() = chart.turn(step);
  const Matrix6d covariance = turn * root * posterior * root.transpose() * turn.transpose();
  out.motion.covariance = 0.5 * (covariance + covariance.transpose());
  out.images = images_alone(measurement(sums, floor, options_.inflation, flow.correlation), root,
                            chart.turn(step), out.motion);
  out.outcome = RefinementOutcome::refined;
  state_length_and_direction(out);
  return out;
}

}  // namespace pade::depth
