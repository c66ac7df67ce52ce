#include "pade/simulation/flight/trajectory.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <fmt/format.h>

namespace pade::simulation {
namespace {

using Matrix8d = Eigen::Matrix<double, 8, 8>;
constexpr int kOrder = 8;  // coefficients of a degree-7 polynomial
constexpr int kInner = 3;  // velocity, acceleration and jerk are free at a waypoint

/// n (n-1) ... (n-order+1): the factor that differentiating x^n `order` times brings out.
double falling_factorial(int n, int order) {
  double product = 1;
  for (int i = 0; i < order; ++i) product *= n - i;
  return product;
}

/// Coefficients of the polynomial on [0, 1] with given value and first three derivatives at both ends: the
/// columns belong to (p, v, a, j) at 0, then at 1.
const Matrix8d& hermite_basis() {
  static const Matrix8d basis = [] {
    Matrix8d ends = Matrix8d::Zero();
    for (int order = 0; order < 4; ++order) {
      ends(order, order) = falling_factorial(order, order);
      for (int n = order; n < kOrder; ++n) ends(4 + order, n) = falling_factorial(n, order);
    }
    return Matrix8d(ends.inverse());
  }();
  return basis;
}

/// Integral of squared snap over [0, 1] as a quadratic form in the ends' derivatives.
const Matrix8d& snap_cost() {
  static const Matrix8d cost = [] {
    Matrix8d power = Matrix8d::Zero();
    for (int m = 4; m < kOrder; ++m) {
      for (int n = 4; n < kOrder; ++n) {
        power(m, n) = falling_factorial(m, 4) * falling_factorial(n, 4) / (m + n - 7);
      }
    }
    return Matrix8d(hermite_basis().transpose() * power * hermite_basis());
  }();
  return cost;
}

/// (1, T, T^2, T^3) twice: from derivatives in seconds to derivatives in fractions of the segment.
Eigen::Matrix<double, 8, 1> derivative_scales(double duration) {
  Eigen::Matrix<double, 8, 1> scales;
  for (int i = 0; i < kOrder; ++i) scales[i] = std::pow(duration, i % 4);
  return scales;
}

/// A direction and its rate of change.
struct Direction {
  Eigen::Vector3d value;
  Eigen::Vector3d rate;
};

Direction normalised(const Eigen::Vector3d& v, const Eigen::Vector3d& rate) {
  const double length = v.norm();
  const Eigen::Vector3d u = v / length;
  return {u, (rate - u * u.dot(rate)) / length};
}

/// Adds a rotation about body axis `axis` to an attitude and its body rate.
void oscillate(const Oscillation& swing, const Eigen::Vector3d& axis, double time,
               Eigen::Quaterniond& rotation, Eigen::Vector3d& rate) {
  if (swing.amplitude == 0) return;
  const double frequency = 2 * std::numbers::pi / swing.period;
  const double angle = swing.amplitude * std::sin(frequency * time + swing.phase);
  const Eigen::Quaterniond step = rotation_exp(angle * axis);
  rotation = rotation * step;
  rate =
      step.conjugate() * rate + swing.amplitude * frequency * std::cos(frequency * time + swing.phase) * axis;
}

/// In which direction a vehicle looks that follows its path. Where it rests, that in which it leaves or
/// arrives.
double heading_of_path(const Trajectory& path, double time, const Eigen::Vector4d& velocity) {
  constexpr double kStill = 1e-12;  // m²/s²
  constexpr double kMoment = 0.02;  // s
  if (velocity.head<2>().squaredNorm() > kStill) return std::atan2(velocity[1], velocity[0]);
  const bool begins = time < 0.5 * path.duration();
  const Eigen::Vector4d moving = path.derivative(begins ? time + kMoment : time - kMoment, 1);
  return std::atan2(moving[1], moving[0]);
}

/// Yaw angles with whole turns added so that no step is longer than half a turn.
void unwrap(std::vector<Eigen::Vector4d>& points) {
  for (std::size_t i = 1; i < points.size(); ++i) {
    points[i][3] = points[i - 1][3] + std::remainder(points[i][3] - points[i - 1][3], 2 * std::numbers::pi);
  }
}

Status check_waypoints(const std::vector<Waypoint>& waypoints, const TrajectoryOptions& options) {
  constexpr std::size_t kMost = 500;  // the system is dense
  if (waypoints.size() < 2 || waypoints.size() > kMost) {
    return Error{fmt::format("waypoints: found {}, expected 2 to {}", waypoints.size(), kMost)};
  }
  if (!(options.speed > 0) || !std::isfinite(options.speed)) {
    return Error{fmt::format("speed: found {}, expected a positive number of m/s", options.speed)};
  }
  for (const Oscillation* swing : {&options.roll, &options.pitch, &options.yaw}) {
    if (!std::isfinite(swing->amplitude) || !(swing->period > 0) || !std::isfinite(swing->phase)) {
      return Error{"oscillation: found a number that is not finite or a period that is not positive"};
    }
  }
  for (std::size_t i = 0; i < waypoints.size(); ++i) {
    const Waypoint& point = waypoints[i];
    if (!point.position.allFinite() || !std::isfinite(point.yaw) ||
        (point.time && !std::isfinite(*point.time))) {
      return Error{fmt::format("waypoint {}: found a number that is not finite", i + 1)};
    }
    if (i > 0 && !point.time && (point.position - waypoints[i - 1].position).norm() < 1e-6) {
      return Error{fmt::format(
          "waypoint {}: found the position of the one before and no time, expected a time_s", i + 1)};
    }
  }
  return {};
}

}  // namespace

Result<Trajectory> Trajectory::through(const std::vector<Waypoint>& waypoints,
                                       const TrajectoryOptions& options) {
  if (const Status status = check_waypoints(waypoints, options); !status) return status.error();
  Trajectory path;
  path.options_ = options;
  std::vector<Eigen::Vector4d> points;
  for (const Waypoint& w : waypoints)
    points.emplace_back(w.position.x(), w.position.y(), w.position.z(), w.yaw);
  unwrap(points);

  // The length of a segment is known only once it has been solved, and its duration decides the solution:
  // repeat.
  constexpr int kRepeats = 4;
  constexpr double kLongest = 1.6;  // of the chord: longer detours would feed on the time that they get
  std::vector<double> lengths(points.size() - 1);
  for (std::size_t i = 0; i + 1 < points.size(); ++i)
    lengths[i] = (points[i + 1] - points[i]).head<3>().norm();
  for (int repeat = 0; repeat < kRepeats; ++repeat) {
    path.times_.assign(1, waypoints[0].time.value_or(0));
    for (std::size_t i = 1; i < points.size(); ++i) {
      const double time = waypoints[i].time.value_or(path.times_.back() + lengths[i - 1] / options.speed);
      if (!(time > path.times_.back())) {
        return Error{
            fmt::format("waypoint {}: found time {} s, expected more than the {} s of the one before", i + 1,
                        time, path.times_.back())};
      }
      path.times_.push_back(time);
    }
    constexpr double kLongestFlight = 6 * 3600;  // s; the limits are checked every centisecond
    if (!(path.times_.back() <= kLongestFlight)) {
      return Error{fmt::format("waypoints: found a flight of {:.6g} s, expected at most {} s",
                               path.times_.back(), kLongestFlight)};
    }
    if (path.times_[0] != 0)
      return Error{fmt::format("waypoint 1: found time {} s, expected 0", path.times_[0])};
    path.solve(points);
    for (std::size_t i = 0; i < lengths.size(); ++i) {
      const double chord = (points[i + 1] - points[i]).head<3>().norm();
      lengths[i] = std::min(path.segment_length(i), kLongest * chord);
    }
  }
  if (const Status status = path.check_limits(); !status) return status.error();
  return path;
}

/// The free derivatives at the waypoints minimise the snap cost: a linear system of normal equations, 3
/// unknowns per waypoint.
void Trajectory::solve(const std::vector<Eigen::Vector4d>& points) {
  const auto n = static_cast<Eigen::Index>(points.size());
  Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(kInner * n, kInner * n);
  Eigen::MatrixXd right = Eigen::MatrixXd::Zero(kInner * n, 4);
  // Derivatives count in units of the mean segment duration, which keeps the system well conditioned.
  const double unit = times_.back() / static_cast<double>(n - 1);
  const auto unknown = [](Eigen::Index point, int end_row) { return kInner * point + (end_row % 4) - 1; };
  for (Eigen::Index s = 0; s + 1 < n; ++s) {
    const auto i = static_cast<std::size_t>(s);
    const double duration = (times_[i + 1] - times_[i]) / unit;
    const auto scales = derivative_scales(duration);
    const Matrix8d cost = scales.asDiagonal() * snap_cost() * scales.asDiagonal() / std::pow(duration, 7);
    for (int row = 0; row < kOrder; ++row) {
      if (row % 4 == 0) continue;
      const Eigen::Index at = unknown(s + row / 4, row);
      right.row(at) -= cost(row, 0) * points[i].transpose() + cost(row, 4) * points[i + 1].transpose();
      for (int column = 0; column < kOrder; ++column) {
        if (column % 4 != 0) normal(at, unknown(s + column / 4, column)) += cost(row, column);
      }
    }
  }
  // Solve for the difference to straight lines flown at an even pace: below four waypoints many paths cost
  // nothing, and the smallest difference is the one to take.
  Eigen::MatrixXd even = Eigen::MatrixXd::Zero(kInner * n, 4);
  for (Eigen::Index p = 0; p < n; ++p) {
    const bool pinned =
        (p == 0 && options_.start == PathEnd::rest) || (p == n - 1 && options_.end == PathEnd::rest);
    const auto before = static_cast<std::size_t>(std::max<Eigen::Index>(p - 1, 0));
    const auto after = static_cast<std::size_t>(std::min<Eigen::Index>(p + 1, n - 1));
    if (!pinned) {
      even.row(kInner * p) =
          (points[after] - points[before]).transpose() * unit / (times_[after] - times_[before]);
    }
  }
  right -= normal * even;
  const auto pin = [&](Eigen::Index point) {
    normal.middleRows(kInner * point, kInner).setZero();
    normal.middleCols(kInner * point, kInner).setZero();
    normal.block(kInner * point, kInner * point, kInner, kInner).setIdentity();
    right.middleRows(kInner * point, kInner).setZero();
  };
  if (options_.start == PathEnd::rest) pin(0);
  if (options_.end == PathEnd::rest) pin(n - 1);
  constexpr Eigen::Index kUnique = 4;
  const Eigen::MatrixXd inner =
      even + (n < kUnique ? Eigen::MatrixXd(normal.completeOrthogonalDecomposition().solve(right))
                          : Eigen::MatrixXd(normal.ldlt().solve(right)));

  segments_.clear();
  for (Eigen::Index s = 0; s + 1 < n; ++s) {
    const auto i = static_cast<std::size_t>(s);
    const auto scales = derivative_scales((times_[i + 1] - times_[i]) / unit);
    Coefficients ends;
    for (int row = 0; row < kOrder; ++row) {
      ends.row(row) = row % 4 == 0
                          ? Eigen::RowVector4d(points[i + static_cast<std::size_t>(row / 4)].transpose())
                          : Eigen::RowVector4d(scales[row] * inner.row(unknown(s + row / 4, row)));
    }
    segments_.emplace_back(hermite_basis() * ends);
  }
}

Eigen::Vector4d Trajectory::derivative(double time, int order) const {
  const double t = std::clamp(time, 0.0, duration());
  const auto after = std::upper_bound(times_.begin() + 1, times_.end() - 1, t);
  const auto segment = static_cast<std::size_t>(after - times_.begin()) - 1;
  const double length = times_[segment + 1] - times_[segment];
  const double x = (t - times_[segment]) / length;
  Eigen::RowVector4d sum = Eigen::RowVector4d::Zero();
  for (int n = kOrder - 1; n >= order; --n) {
    sum = sum * x + falling_factorial(n, order) * segments_[segment].row(n);
  }
  return sum.transpose() / std::pow(length, order);
}

double Trajectory::segment_length(std::size_t segment) const {
  constexpr int kSteps = 64;
  const double step = (times_[segment + 1] - times_[segment]) / kSteps;
  double length = 0;
  for (int i = 0; i < kSteps; ++i) {
    length += step * derivative(times_[segment] + (i + 0.5) * step, 1).head<3>().norm();
  }
  return length;
}

KinematicState Trajectory::at(double time) const {
  KinematicState state;
  const double t = std::clamp(time, 0.0, duration());
  state.time = Time::from_seconds(t);
  const Eigen::Vector4d position = derivative(t, 0);
  const Eigen::Vector4d velocity = derivative(t, 1);
  const Eigen::Vector4d acceleration = derivative(t, 2);
  const Eigen::Vector4d jerk = derivative(t, 3);
  state.velocity = velocity.head<3>();
  state.acceleration = acceleration.head<3>();

  double yaw = position[3];
  double yaw_rate = velocity[3];
  if (options_.heading == Heading::path) {
    yaw = heading_of_path(*this, t, velocity);
    const double horizontal = velocity.head<2>().squaredNorm();
    yaw_rate = horizontal > 1e-12
                   ? (velocity[0] * acceleration[1] - velocity[1] * acceleration[0]) / horizontal
                   : 0.0;
  }
  // Body z is the direction of thrust; body x lies in the vertical plane of the heading (Mellinger & Kumar,
  // Eq. 6-8).
  const Direction z = normalised(
      state.acceleration + options_.drag * state.velocity + Eigen::Vector3d(0, 0, options_.gravity),
      jerk.head<3>() + options_.drag * state.acceleration);
  const Eigen::Vector3d heading(std::cos(yaw), std::sin(yaw), 0);
  const Eigen::Vector3d heading_rate = yaw_rate * Eigen::Vector3d(-heading.y(), heading.x(), 0);
  const Direction y = normalised(z.value.cross(heading), z.rate.cross(heading) + z.value.cross(heading_rate));
  const Direction x{y.value.cross(z.value), y.rate.cross(z.value) + y.value.cross(z.rate)};
  Eigen::Matrix3d rotation;
  rotation << x.value, y.value, z.value;
  Eigen::Quaterniond attitude(rotation);
  // R^T dR/dt is the skew matrix of the body rate.
  Eigen::Vector3d rate(z.value.dot(y.rate), x.value.dot(z.rate), y.value.dot(x.rate));
  oscillate(options_.yaw, Eigen::Vector3d::UnitZ(), t, attitude, rate);
  oscillate(options_.pitch, Eigen::Vector3d::UnitY(), t, attitude, rate);
  oscillate(options_.roll, Eigen::Vector3d::UnitX(), t, attitude, rate);
  state.R_world_body = attitude.normalized();
  state.position = position.head<3>();
  state.angular_velocity = rate;
  return state;
}

Status Trajectory::check_limits() const {
  struct Check {
    const char* name = "";
    const char* unit = "";
    double limit = 0;
    double scale = 1;
    double worst = 0;
    double when = 0;
  };
  const double degrees = 180 / std::numbers::pi;
  Check checks[] = {{"speed", "m/s", options_.limits.speed},
                    {"acceleration", "m/s^2", options_.limits.acceleration},
                    {"tilt", "deg", options_.limits.tilt, degrees},
                    {"angular rate", "deg/s", options_.limits.angular_rate, degrees}};
  constexpr double kStep = 0.01;
  std::optional<Eigen::Quaterniond> before;
  for (double t = 0; t <= duration(); t += kStep) {
    const KinematicState state = at(t);
    // Where a vehicle that follows its path turns back on a straight line, its rate says nothing of it.
    const double turned = before ? before->angularDistance(state.R_world_body) / kStep : 0;
    before = state.R_world_body;
    const double up = (state.R_world_body * Eigen::Vector3d::UnitZ()).z();
    const double values[] = {state.velocity.norm(), state.acceleration.norm(),
                             std::acos(std::clamp(up, -1.0, 1.0)),
                             std::max(turned, state.angular_velocity.norm())};
    for (int i = 0; i < 4; ++i) {
      // NaN is worse than any number, and stays the worst.
      if (!(values[i] <= checks[i].worst) && !std::isnan(checks[i].worst)) {
        checks[i].worst = values[i];
        checks[i].when = t;
      }
    }
  }
  for (const Check& check : checks) {
    if (!(check.worst <= check.limit)) {
      const auto after = std::upper_bound(times_.begin() + 1, times_.end() - 1, check.when);
      const auto next = after - times_.begin();
      return Error{
          fmt::format("{} between waypoints {} and {}: found {:.2f} {} after {:.2f} s, expected at most "
                      "{:.2f}; lower the speed, "
                      "round the corner or raise the limit",
                      check.name, next, next + 1, check.worst * check.scale, check.unit, check.when,
                      check.limit * check.scale)};
    }
  }
  return {};
}

}  // namespace pade::simulation
