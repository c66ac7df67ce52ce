// The camera in the filter: motions between images as measurements of a copy of the pose at the older one
// and of the present pose (docs/navigation.md, section 9).
#include <algorithm>
#include <array>
#include <cmath>

#include <Eigen/Eigenvalues>

#include "pade/navigation/camera/camera_models.hpp"
#include "pade/navigation/filter.hpp"

namespace pade::navigation {
namespace {

constexpr double kUntold = 0.3;              // rad: what the images tell with a larger σ is not asked for
constexpr double kShortBaseline = 0.45;      // of its length: with a larger σ a baseline has no direction
constexpr double kShareOfLikelihood = 0.25;  // neighbouring images err together: what they say of hypotheses

/// Bounds of chi-square that 99.9 % keep, by degrees of freedom.
constexpr std::array<double, 6> kGates = {0, 10.83, 13.82, 16.27, 18.47, 20.52};

/// Information about the rotation alone, whatever the direction.
Matrix6d rotation_of(const Matrix6d& information) {
  const Matrix3d directions = information.topLeftCorner<3, 3>();
  const Matrix3d both = information.topRightCorner<3, 3>();
  const Eigen::SelfAdjointEigenSolver<Matrix3d> parts(directions);
  const double least = 1e-9 * std::max(parts.eigenvalues().maxCoeff(), 1e-9);
  Matrix3d inverse = Matrix3d::Zero();
  for (int i = 0; i < 3; ++i) {
    const Vector3d axis = parts.eigenvectors().col(i);
    if (parts.eigenvalues()[i] > least) inverse += axis * axis.transpose() / parts.eigenvalues()[i];
  }
  Matrix6d out = Matrix6d::Zero();
  out.bottomRightCorner<3, 3>() = information.bottomRightCorner<3, 3>() - both.transpose() * inverse * both;
  return out;
}

using Rows = Eigen::Matrix<double, Eigen::Dynamic, 6, 0, 5, 6>;

/// Rows W with W^T W = information, but for what is hardly told.
Rows whitened(const Matrix6d& information) {
  const Eigen::SelfAdjointEigenSolver<Matrix6d> parts(0.5 * (information + information.transpose()));
  Rows rows(0, 6);
  for (int i = 5; i >= 1; --i) {
    const double told = parts.eigenvalues()[i];
    if (!(told * kUntold * kUntold > 1)) break;
    rows.conservativeResize(rows.rows() + 1, 6);
    rows.row(rows.rows() - 1) = std::sqrt(told) * parts.eigenvectors().col(i).transpose();
  }
  return rows;
}

}  // namespace

bool is_usable(const CameraMotion& motion) {
  constexpr double kRounding = 1e-6;
  if (!(motion.t1 < motion.t2) || !motion.R_2_1.allFinite() || !motion.direction_2_1.allFinite() ||
      !motion.information.allFinite() || !motion.T_body_camera.is_finite())
    return false;
  if (!(motion.R_2_1 * motion.R_2_1.transpose()).isIdentity(kRounding) || motion.R_2_1.determinant() < 0)
    return false;
  if (std::abs(motion.direction_2_1.norm() - 1) > kRounding ||
      std::abs(motion.T_body_camera.rotation.norm() - 1) > kRounding)
    return false;
  const double scale = motion.information.cwiseAbs().maxCoeff();
  if (!(motion.information - motion.information.transpose()).isZero(kRounding * scale)) return false;
  const Eigen::SelfAdjointEigenSolver<Matrix6d> parts(motion.information, Eigen::EigenvaluesOnly);
  return parts.eigenvalues().minCoeff() >= -kRounding * scale;
}

void Filter::start_camera() {
  core_.camera = {};
  const double sigma = options_.camera_mounting_sigma;
  P_.diagonal().segment<3>(camera_at() + kMounting).setConstant(sigma * sigma);
}

Innovation Filter::mark_image() {
  if (!options_.camera) return {};
  flush();
  const int to = camera_at() + kAnchorPose;
  P_.middleRows<3>(to) = P_.middleRows<3>(kPhi).eval();
  P_.middleRows<3>(to + 3) = P_.middleRows<3>(kRho).eval();
  P_.middleCols<3>(to) = P_.middleCols<3>(kPhi).eval();
  P_.middleCols<3>(to + 3) = P_.middleCols<3>(kRho).eval();
  core_.camera.anchored = true;
  core_.camera.anchor_time = core_.state.time;
  core_.camera.anchor = {core_.state.X.R, core_.state.X.p};
  return {};
}

Innovation Filter::update(const CameraMotion& motion) {
  if (!options_.camera) return {};
  flush();
  Innovation innovation;
  if (core_.camera.anchored && core_.camera.anchor_time == motion.t1) {
    innovation = correct_by_camera(motion);
  } else {
    ++core_.camera.tally.unanchored;
  }
  mark_image();
  return innovation;
}

Innovation Filter::correct_by_camera(const CameraMotion& motion) {
  using Tall = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMaxState, 6>;
  using Square = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, 6, 6>;
  using Short = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 6, 1>;
  const int at = camera_at();
  const CameraPrediction predicted =
      predict_camera_motion(core_.camera, {core_.state.X.R, core_.state.X.p}, motion.T_body_camera);

  // Of (translation, rotation) with all errors, and its own covariance.
  const Eigen::Matrix<double, 6, 3> now_phi = predicted.by_now.leftCols<3>();
  const Eigen::Matrix<double, 6, 3> now_rho = predicted.by_now.rightCols<3>();
  Tall PHt = P_.middleCols<3>(kPhi) * now_phi.transpose();
  PHt += P_.middleCols<3>(kRho) * now_rho.transpose();
  PHt += P_.middleCols<6>(at + kAnchorPose) * predicted.by_anchor.transpose();
  PHt += P_.middleCols<3>(at + kMounting) * predicted.by_mounting.transpose();
  const auto by_errors = [&](const Tall& tall) -> Matrix6d {
    return now_phi * tall.middleRows<3>(kPhi) + now_rho * tall.middleRows<3>(kRho) +
           predicted.by_anchor * tall.middleRows<6>(at + kAnchorPose) +
           predicted.by_mounting * tall.middleRows<3>(at + kMounting);
  };
  const Matrix6d prior = by_errors(PHt);

  const Vector3d& t = predicted.T_2_1.translation;
  const double length = t.norm();
  const Vector3d direction = length > 0 ? Vector3d(t / length) : Vector3d(motion.direction_2_1);
  const Matrix3d across = Matrix3d::Identity() - direction * direction.transpose();
  // Also along it: at rest a direction once believed would else make itself certain.
  const bool has_direction = std::sqrt(prior.topLeftCorner<3, 3>().trace()) < kShortBaseline * length;
  const Matrix6d information = has_direction ? motion.information : rotation_of(motion.information);
  const Rows W = whitened(information / options_.camera_inflation);
  const auto n = W.rows();
  if (n == 0) return {};

  Vector6d residual;  // of (direction, rotation vector)
  residual << turn_between(direction, motion.direction_2_1),
      rotation_log(Matrix3d(motion.R_2_1 * predicted.T_2_1.matrix3().transpose()));
  Rows H = W;  // of (translation, rotation)
  H.leftCols<3>() = W.leftCols<3>() * across / std::max(length, 1e-6);
  if (!has_direction) H.leftCols<3>().setZero();
  const Short r = W * residual;
  Square S = H * prior * H.transpose() + Square::Identity(n, n);

  Innovation innovation;
  innovation.size = static_cast<int>(n);
  innovation.residual = residual.tail<3>();
  innovation.sigma = prior.bottomRightCorner<3, 3>().diagonal().cwiseMax(0).cwiseSqrt();
  Eigen::LLT<Square> factor(S);
  if (factor.info() != Eigen::Success || !r.allFinite()) return {};
  const Short white = factor.matrixL().solve(r);
  innovation.white.head(std::min<Eigen::Index>(3, n)) = white.head(std::min<Eigen::Index>(3, n));
  innovation.chi_square = white.squaredNorm();
  if (!std::isfinite(innovation.chi_square)) return {};
  const double gate = kGates.at(static_cast<std::size_t>(n));
  innovation.log_likelihood =
      -0.5 * innovation.chi_square - factor.matrixLLT().diagonal().array().log().sum();
  core_.log_likelihood += kShareOfLikelihood *
                          (innovation.log_likelihood + 0.5 * std::max(0.0, innovation.chi_square - 2 * gate));
  innovation.verdict = Verdict::accepted;
  if (innovation.chi_square > gate) {
    const double excess = innovation.chi_square / gate;
    innovation.verdict = excess > options_.soft_gate ? Verdict::rejected : Verdict::inflated;
    if (innovation.verdict == Verdict::rejected) {
      ++core_.camera.tally.refused;
      return innovation;
    }
    S *= excess;
    factor.compute(S);
  }
  ++(has_direction ? core_.camera.tally.used : core_.camera.tally.rotation_only);
  const Tall PWt = PHt * H.transpose();
  const Tall K = factor.solve(PWt.transpose()).transpose();
  const Tall half = PWt - 0.5 * (K * S);
  P_.noalias() -= K * half.transpose();
  P_.noalias() -= half * K.transpose();
  apply(K * r);
  return innovation;
}

CloneMotion Filter::camera_motion_since(int index, const Pose& T_body_camera) {
  const CloneMotion body = motion_since(index);
  const Pose mounted = options_.camera ? core_.camera.mounted(T_body_camera) : T_body_camera;
  const Pose T_camera_body = mounted.inverse();
  CloneMotion motion;
  motion.T_1_2 = T_camera_body * body.T_1_2 * mounted;
  // ξ of the body at t2 to ξ of the camera.
  const Matrix6d Ad = adjoint(T_camera_body);
  motion.covariance = Ad * body.covariance * Ad.transpose();
  if (!options_.camera) return motion;
  // The mounting's error is in both poses: ξ_c = Ad ξ + (I - Ad(T_12^-1)) μ.
  const int mu = camera_at() + kMounting;
  const int c = clone_at(index);
  Eigen::Matrix<double, 6, 3> with_mounting;  // covariance of ξ of the body and μ
  with_mounting << P_.block<3, 3>(kPhi, mu), P_.block<3, 3>(kRho, mu);
  with_mounting -= adjoint(body.T_1_2.inverse()) * P_.block<6, 3>(c, mu);
  const Eigen::Matrix<double, 6, 3> by_mounting =
      (Matrix6d::Identity() - adjoint(motion.T_1_2.inverse())).leftCols<3>();
  const Matrix6d mixed = Ad * with_mounting * by_mounting.transpose();
  motion.covariance +=
      mixed + mixed.transpose() + by_mounting * P_.block<3, 3>(mu, mu) * by_mounting.transpose();
  return motion;
}

}  // namespace pade::navigation
