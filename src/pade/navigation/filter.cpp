#include "pade/navigation/filter.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace pade::navigation {
namespace {

constexpr double kSmoothTime = 2.0;            // s
constexpr double kVibrationTime = 1.0;         // over which the level of vibration is averaged, s
constexpr double kLargestRateVariance = 1;     // what is more is a fault, (rad/s)²
constexpr double kLargestForceVariance = 400;  // (m/s²)²
constexpr double kAxleDistance = 1.0;          // m

double wrap_angle(double angle) { return std::remainder(angle, 2 * std::numbers::pi); }

/// White noise of each axis, unit²/Hz: the instrument's own and the share of vibration of the given variance.
Vector3d noise_power(double density, double share, const Vector3d& variance, double interval) {
  return Vector3d::Constant(density * density) + share * share * interval * variance;
}

}  // namespace

void Vibration::observe(const ImuSample& sample, double longest_interval) {
  const double dt = seconds_between(last.time, sample.time);
  if (samples > 0 && (dt <= 0 || dt > longest_interval)) samples = 0;
  if (samples >= 2) {
    // The second difference of white samples has six times their variance; smooth motion has hardly any.
    const double gain = 1 - std::exp(-dt / kVibrationTime);
    const auto learn = [&](Vector3d& variance, const Vector3d& difference, double largest) {
      variance += gain * (difference.cwiseAbs2().cwiseMin(6 * largest) / 6 - variance);
    };
    learn(rate_variance, sample.angular_rate - 2 * last.angular_rate + before_last.angular_rate,
          kLargestRateVariance);
    learn(force_variance, sample.specific_force - 2 * last.specific_force + before_last.specific_force,
          kLargestForceVariance);
    interval += gain * (dt - interval);
  }
  before_last = last;
  last = sample;
  ++samples;
}

void Filter::start(const NavigationState& state, const BaseMatrix& covariance) {
  core_ = {};
  core_.state = state;
  core_.position_accepted = core_.velocity_accepted = state.time;
  clones_ = 0;
  P_.setZero(common(), common());
  P_.topLeftCorner<kBase, kBase>() = covariance;
  if (options_.camera) start_camera();
}

FilterSnapshot Filter::snapshot() const {
  FilterSnapshot snapshot;
  static_cast<FilterCore&>(snapshot) = core_;
  snapshot.P = P_.topLeftCorner(common(), common());
  return snapshot;
}

void Filter::restore(const FilterSnapshot& snapshot) {
  core_ = static_cast<const FilterCore&>(snapshot);
  clones_ = 0;
  P_ = snapshot.P;
}

void Filter::drop_clones() {
  clones_ = 0;
  P_.conservativeResize(common(), common());
}

BaseMatrix Filter::covariance() {
  flush();
  return P_.topLeftCorner<kBase, kBase>();
}

void Filter::propagate(Time to, const Vector3d& rate_mean, const Vector3d& force_mean,
                       const Vector3d& rate_end) {
  NavigationState& state = core_.state;
  const double dt = seconds_between(state.time, to);
  if (dt <= 0) return;
  const ImuStep step = imu_step(rate_mean - state.gyroscope_bias, force_mean - state.accelerometer_bias, dt);
  // A saturated sensor has seen less than there was.
  const bool rate_saturated = rate_mean.cwiseAbs().maxCoeff() > options_.gyroscope_range;
  const bool force_saturated = force_mean.cwiseAbs().maxCoeff() > options_.accelerometer_range;
  const Vibration& vibration = core_.vibration;
  const double saturated = 1e5;
  const double rate_noise = options_.camera
                                ? std::max(options_.gyroscope_noise, options_.camera_gyroscope_noise)
                                : options_.gyroscope_noise;
  accumulate(
      core_.pending, step, dt,
      noise_power(rate_noise, options_.gyroscope_vibration, vibration.rate_variance, vibration.interval) *
          (rate_saturated ? saturated : 1),
      noise_power(options_.accelerometer_noise, options_.accelerometer_vibration, vibration.force_variance,
                  vibration.interval) *
          (force_saturated ? saturated : 1));

  const Vector3d gravity(0, 0, -options_.gravity);
  const Matrix3d R = state.X.R.toRotationMatrix();
  state.X.p += dt * state.X.v + 0.5 * dt * dt * gravity + R * step.p;
  const Vector3d change = dt * gravity + R * step.v;
  state.X.v += change;
  core_.integrity.yaw.inertial(change);
  state.X.R = (state.X.R * Quaterniond(step.R)).normalized();
  state.angular_rate = rate_end - state.gyroscope_bias;
  state.time = to;
  const double decay = std::exp(-dt / kSmoothTime);
  core_.smooth_position *= decay;
  core_.smooth_rotation *= decay;
}

void Filter::add_gap_noise(double from, double to) {
  core_.integrity.yaw.interrupt();
  const double rate = options_.gap_rate;
  const double acceleration = options_.gap_acceleration;
  const double squares = to * to - from * from;
  auto noise = core_.pending.noise.diagonal();
  noise.head<3>().array() += rate * rate * squares;
  noise.segment<3>(3).array() += acceleration * acceleration * squares;
  noise.tail<3>().array() += 0.25 * acceleration * acceleration * squares * (to * to + from * from);
}

void Filter::flush() {
  const ImuIncrement& pending = core_.pending;
  const double T = pending.duration;
  if (T <= 0 && pending.noise.isZero(0)) return;
  Eigen::Matrix<double, kCore, kCore> Phi = Eigen::Matrix<double, kCore, kCore>::Identity();
  Phi.topLeftCorner<9, 9>() = pending.transition();
  Phi.topRightCorner<9, 6>() = pending.bias_jacobian;

  // Core, then cross terms with everything else, in the order that needs no copy.
  const Eigen::Matrix<double, kCore, kCore> core = Phi * P_.topLeftCorner<kCore, kCore>() * Phi.transpose();
  P_.topLeftCorner<kCore, kCore>() = 0.5 * (core + core.transpose());
  P_.topLeftCorner<9, 9>() += 0.5 * (pending.noise + pending.noise.transpose());
  const int rest = size() - kCore;
  const Eigen::Matrix<double, kCore, Eigen::Dynamic, 0, kCore, kMaxState - kCore> cross =
      Phi * P_.topRightCorner(kCore, rest);
  P_.topRightCorner(kCore, rest) = cross;

  const auto walk = [&](int first, double density) {
    P_.diagonal().segment<3>(first).array() += density * density * T;
  };
  walk(kGyroscopeBias, options_.gyroscope_bias_walk);
  walk(kAccelerometerBias, options_.accelerometer_bias_walk);

  const double tau = core_.gnss_class.correlation_time;
  const double position_decay = tau > 0 ? std::exp(-T / tau) : 1;
  const double height_decay = std::exp(-T / options_.barometer_correlation_time);
  P_.middleCols<3>(kPositionBias) *= position_decay;
  P_.middleRows<3>(kPositionBias) *= position_decay;
  P_.col(kHeightBias) *= height_decay;
  P_.row(kHeightBias) *= height_decay;
  P_.diagonal().segment<3>(kPositionBias) +=
      (1 - position_decay * position_decay) * core_.gnss_class.bias_sigma.cwiseAbs2();
  P_(kHeightBias, kHeightBias) +=
      (1 - height_decay * height_decay) * options_.barometer_bias_sigma * options_.barometer_bias_sigma;
  const double iron_decay = std::exp(-T / options_.iron_correlation_time);
  P_.middleCols<3>(kIron) *= iron_decay;
  P_.middleRows<3>(kIron) *= iron_decay;
  P_.diagonal().segment<3>(kIron).array() +=
      (1 - iron_decay * iron_decay) * options_.iron_sigma * options_.iron_sigma;
  const Vector3d settled = core_.gnss_class.bias_sigma.cwiseAbs2();
  core_.gnss_class.bias_variance =
      settled + position_decay * position_decay * (core_.gnss_class.bias_variance - settled);
  core_.state.position_bias *= position_decay;
  core_.state.height_bias *= height_decay;
  core_.state.iron *= iron_decay;

  P_.bottomLeftCorner(rest, kCore) = P_.topRightCorner(kCore, rest).transpose();
  if (options_.raw_gnss) flush_receiver(T);
  core_.pending = {};
}

template <int M>
Innovation Filter::correct(const Prediction<M>& prediction, const Eigen::Matrix<double, M, 1>& residual,
                           Eigen::Matrix<double, M, M> noise, double gate, bool force) {
  using Tall = Eigen::Matrix<double, Eigen::Dynamic, M, 0, kMaxState, M>;
  using Square = Eigen::Matrix<double, M, M>;
  const Tall PHt = P_.leftCols<kBase>() * prediction.H.transpose();
  Square S = prediction.H * PHt.template topRows<kBase>() + noise;
  Innovation innovation;
  innovation.size = M;
  innovation.residual.template head<M>() = residual;
  innovation.sigma.template head<M>() = S.diagonal().cwiseSqrt();
  Eigen::LLT<Square> factor(S);
  if (factor.info() != Eigen::Success || !residual.allFinite()) return innovation;
  innovation.white.template head<M>() = factor.matrixL().solve(residual);
  innovation.chi_square = innovation.white.squaredNorm();
  if (!std::isfinite(innovation.chi_square)) return innovation;
  innovation.log_likelihood =
      -0.5 * innovation.chi_square - factor.matrixLLT().diagonal().array().log().sum();
  // An outlier tells little about which hypothesis is right: its share is bounded.
  core_.log_likelihood += innovation.log_likelihood + 0.5 * std::max(0.0, innovation.chi_square - 2 * gate);
  innovation.verdict = Verdict::accepted;
  if (innovation.chi_square > gate) {
    const double excess = innovation.chi_square / gate;
    innovation.verdict = excess > options_.soft_gate && !force ? Verdict::rejected : Verdict::inflated;
    if (innovation.verdict == Verdict::rejected) return innovation;
    S *= excess;  // noise + (excess - 1) S: the residual lies on the gate
    factor.compute(S);
  }
  const Tall K = factor.solve(PHt.transpose()).transpose();
  // Joseph form multiplied out, (I - KH) P (I - KH)^T + K N K^T = P - K W^T - W K^T with W = P H^T - K S / 2.
  const Tall W = PHt - 0.5 * (K * S);
  P_.noalias() -= K * W.transpose();
  P_.noalias() -= W * K.transpose();
  apply(K * residual);
  return innovation;
}

template Innovation Filter::correct<3>(const Prediction<3>&, const Vector3d&, Matrix3d, double, bool);
template Innovation Filter::correct<1>(const Prediction<1>&, const Eigen::Matrix<double, 1, 1>&,
                                       Eigen::Matrix<double, 1, 1>, double, bool);

void Filter::apply(const Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMaxState, 1>& error) {
  const ExtendedPose before = core_.state.X;
  core_.integrity.yaw.turned((before.R * error.segment<3>(kPhi)).z());
  core_.state.retract(error.head<kBase>());
  if (options_.raw_gnss) core_.raw.receiver.retract(error.segment<kRawStates>(kBase));
  if (options_.camera) core_.camera.retract(error.segment<kCameraStates>(camera_at()));
  for (int i = 0; i < clones_; ++i) {
    const auto xi = error.segment<6>(clone_at(i));
    Pose& pose = clone_poses_[static_cast<std::size_t>(i)];
    const Vector3d phi = xi.head<3>();
    pose = pose * Pose{rotation_exp(phi), left_jacobian(phi) * xi.tail<3>()};
  }
  // The smooth pose stays where it was.
  core_.smooth_position += before.p - core_.state.X.p;
  core_.smooth_rotation =
      rotation_log(Quaterniond(rotation_exp(core_.smooth_rotation) * before.R * core_.state.X.R.conjugate()));
}

Innovation Filter::update(const ZeroVelocity& stop) {
  flush();
  const Prediction<3> prediction = predict_velocity(core_.state);
  const double sigma = std::max(stop.sigma, 1e-3);
  return correct<3>(prediction, -prediction.value, sigma * sigma * Matrix3d::Identity(),
                    options_.gate_probability_3);
}

Innovation Filter::update(const BarometricHeight& height) {
  if (!std::isfinite(height.height) || !std::isfinite(height.sigma)) return {};
  flush();
  if (!core_.height_known) {  // the first reading defines the zero
    core_.height_known = true;
    core_.state.height_zero = height.height - core_.state.X.p.z();
    core_.state.height_bias = 0;
    P_.col(kHeightBias).setZero();
    P_.row(kHeightBias).setZero();
    P_(kHeightBias, kHeightBias) = options_.barometer_bias_sigma * options_.barometer_bias_sigma;
  }
  const Prediction<1> prediction = predict_barometric_height(core_.state);
  const Eigen::Matrix<double, 1, 1> residual(height.height - prediction.value[0]);
  const double sigma = std::max(height.sigma, 0.01);
  return correct<1>(prediction, residual, Eigen::Matrix<double, 1, 1>(sigma * sigma),
                    options_.gate_probability_1);
}

Innovation Filter::update(const Heading& heading) {
  flush();
  const auto prediction = predict_azimuth(core_.state, Vector3d::UnitX());
  if (!prediction || !std::isfinite(heading.yaw) || !std::isfinite(heading.sigma)) return {};
  const Eigen::Matrix<double, 1, 1> residual(wrap_angle(heading.yaw - prediction->value[0]));
  const double sigma = std::max(heading.sigma, 1e-3);
  const Innovation innovation = correct<1>(*prediction, residual, Eigen::Matrix<double, 1, 1>(sigma * sigma),
                                           options_.gate_probability_1);
  judge_azimuth(core_.integrity.heading, innovation);
  return innovation;
}

Innovation Filter::update(const MagneticField& field, double declination) {
  flush();
  const double norm = field.field.norm();
  if (!std::isfinite(norm) || !(norm > 0) || !std::isfinite(field.sigma)) return {};
  const auto prediction = predict_magnetic_azimuth(core_.state, field.field / norm);
  if (!prediction) return {};
  const double north = 0.5 * std::numbers::pi - declination;
  const Eigen::Matrix<double, 1, 1> residual(wrap_angle(north - prediction->value[0]));
  // The azimuth hangs on the horizontal part of the field alone: the field's error moves it as the iron does.
  const double lever = prediction->H.middleCols<3>(kIron).norm();
  const double sigma = lever * std::max(field.sigma, 1e-3);
  // No innovation passes a gate of zero.
  const double gate = core_.integrity.magnetometer_doubted ? 0 : options_.gate_probability_1;
  const Innovation innovation =
      correct<1>(*prediction, residual, Eigen::Matrix<double, 1, 1>(sigma * sigma), gate);
  NavigationState without_iron = core_.state;
  without_iron.iron.setZero();
  const auto bare = predict_magnetic_azimuth(without_iron, field.field / norm);
  const double turn = bare ? wrap_angle(north - bare->value[0]) : residual[0];
  judge_magnetometer(innovation, turn, std::hypot(sigma, lever * options_.iron_sigma));
  return innovation;
}

Innovation Filter::update(const RangeToGround& range) {
  flush();
  const auto prediction = predict_range(core_.state, range.ground_height);
  if (!prediction || !std::isfinite(range.range) || !std::isfinite(range.sigma)) return {};
  const Eigen::Matrix<double, 1, 1> residual(range.range - prediction->value[0]);
  const double sigma = std::max(range.sigma, 0.005);
  return correct<1>(*prediction, residual, Eigen::Matrix<double, 1, 1>(sigma * sigma),
                    options_.gate_probability_1);
}

Innovation Filter::update(const RoadMotion& road) {
  flush();
  const Prediction<2> prediction = predict_road_motion(core_.state);
  // The point that does not slip is the rear axle, an unknown distance of about a metre away.
  const double swing = kAxleDistance * core_.state.angular_rate.norm();
  const double sigma = std::hypot(std::max(road.sigma, 0.01), swing);
  return correct<2>(prediction, -prediction.value, sigma * sigma * Eigen::Matrix2d::Identity(),
                    options_.gate_probability_2);
}

Innovation Filter::update_static_force(const Vector3d& force, double sigma) {
  flush();
  const Prediction<3> prediction = predict_static_force(core_.state, options_.gravity);
  return correct<3>(prediction, force - prediction.value, sigma * sigma * Matrix3d::Identity(),
                    options_.gate_probability_3, true);
}

int Filter::clone() {
  if (clones_ == kMaxClones) return -1;
  flush();
  const int n = size();
  clone_poses_[static_cast<std::size_t>(clones_)] = {core_.state.X.R, core_.state.X.p};
  P_.conservativeResize(n + 6, n + 6);
  P_.middleRows(n, 3).leftCols(n) = P_.middleRows<3>(kPhi).leftCols(n).eval();
  P_.middleRows(n + 3, 3).leftCols(n) = P_.middleRows<3>(kRho).leftCols(n).eval();
  P_.middleCols(n, 3).topRows(n) = P_.middleRows(n, 3).leftCols(n).transpose().eval();
  P_.middleCols(n + 3, 3).topRows(n) = P_.middleRows(n + 3, 3).leftCols(n).transpose().eval();
  P_.block<3, 3>(n, n) = P_.block<3, 3>(kPhi, kPhi).eval();
  P_.block<3, 3>(n, n + 3) = P_.block<3, 3>(kPhi, kRho).eval();
  P_.block<3, 3>(n + 3, n) = P_.block<3, 3>(kRho, kPhi).eval();
  P_.block<3, 3>(n + 3, n + 3) = P_.block<3, 3>(kRho, kRho).eval();
  return clones_++;
}

CloneMotion Filter::motion_since(int index) {
  flush();
  const Pose& first = clone_poses_[static_cast<std::size_t>(index)];
  const Pose now{core_.state.X.R, core_.state.X.p};
  CloneMotion motion;
  motion.T_1_2 = first.inverse() * now;
  // ξ_12 = ξ_2 - Ad(T_12^-1) ξ_1
  const Matrix6d Ad = adjoint(motion.T_1_2.inverse());
  const int c = clone_at(index);
  const int pose_rows[2] = {kPhi, kRho};
  Matrix6d P22;
  Matrix6d P21;
  for (int i = 0; i < 2; ++i) {
    P21.middleRows<3>(3 * i) = P_.block<3, 6>(pose_rows[i], c);
    for (int j = 0; j < 2; ++j) P22.block<3, 3>(3 * i, 3 * j) = P_.block<3, 3>(pose_rows[i], pose_rows[j]);
  }
  const Matrix6d P11 = P_.block<6, 6>(c, c);
  const Matrix6d sum = P22 - P21 * Ad.transpose() - Ad * P21.transpose() + Ad * P11 * Ad.transpose();
  motion.covariance = 0.5 * (sum + sum.transpose());
  return motion;
}

ExtendedPose Filter::smooth_pose() const {
  const ExtendedPose& X = core_.state.X;
  return {(rotation_exp(core_.smooth_rotation) * X.R).normalized(), X.v, X.p + core_.smooth_position};
}

}  // namespace pade::navigation
