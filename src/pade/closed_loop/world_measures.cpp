#include "pade/closed_loop/world_measures.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace pade::closed_loop {
namespace {

using Eigen::Vector3d;

/// The i-th point of van der Corput's sequence: evenly spread over 0 to 1, in no order.
double spread(int i, int base) {
  double value = 0;
  for (double digit = 1.0 / base; i > 0; i /= base, digit /= base) value += digit * (i % base);
  return value;
}

/// The way as axes: along it, and to its left.
struct Axes {
  explicit Axes(const FlightTask& task)
      : start(task.start), along(task.goal - task.start), length(along.head<2>().norm()) {
    along.z() = 0;
    along.normalize();
    left = {-along.y(), along.x(), 0};
  }
  [[nodiscard]] Vector3d at(double ahead, double aside) const { return start + ahead * along + aside * left; }
  Vector3d start, along;
  double length;
  Vector3d left;
};

double free_path(const FlightTask& task, Vector3d from, const Vector3d& direction, double radius) {
  constexpr double kLongest = 20;      // m
  constexpr double kLeastStep = 0.01;  // m
  double gone = 0;
  while (gone < kLongest) {
    const double step = task.surface.to(from, kLongest + radius) - radius;
    if (step <= 0) return gone;
    const double taken = std::max(step, kLeastStep);
    gone += taken;
    from += taken * direction;
  }
  return kLongest;
}

double traversability(const FlightTask& task, double radius) {
  constexpr int kPaths = 300;
  constexpr double kAside = 5;  // m
  const Axes axes(task);
  double sum = 0;
  int paths = 0;
  for (int i = 1; i <= kPaths; ++i) {
    const Vector3d place = axes.at(axes.length * spread(i, 2), kAside * (2 * spread(i, 3) - 1));
    if (task.surface.touches(place, radius)) continue;
    const double angle = 2 * std::numbers::pi * spread(i, 5);
    sum += free_path(task, place, std::cos(angle) * axes.along + std::sin(angle) * axes.left, radius);
    ++paths;
  }
  return paths > 0 ? sum / paths / radius : 0;
}

std::optional<double> mean_gap(const FlightTask& task) {
  constexpr double kAside = 10;     // m
  constexpr double kStep = 0.05;    // m
  constexpr double kTouch = 0.026;  // m: no surface slips between two looks
  const Axes axes(task);
  double sum = 0;
  int gaps = 0;
  for (double ahead = 0.5; ahead < axes.length; ++ahead) {
    std::optional<double> last;  // where something was
    for (int i = 0; i * kStep <= 2 * kAside; ++i) {
      const double aside = i * kStep - kAside;
      if (!task.surface.touches(axes.at(ahead, aside), kTouch)) continue;
      if (last && aside - *last > 2 * kStep) {
        sum += aside - *last;
        ++gaps;
      }
      last = aside;
    }
  }
  if (gaps == 0) return std::nullopt;
  return sum / gaps;
}

}  // namespace

WorldMeasures measures_of_world(const FlightTask& task, double radius) {
  WorldMeasures measures;
  measures.traversability = traversability(task, radius);
  if (const auto gap = mean_gap(task)) measures.relative_gap = *gap / (2 * radius);
  return measures;
}

double free_about(const FlightTask& task, double climb, double most) {
  constexpr double kGround = 0.2;  // m
  const double step = std::max(0.1, most / 20);
  const Vector3d low = task.start - climb * Vector3d::UnitZ();
  const double fall = task.scene.distance(low, -Vector3d::UnitZ());
  const double ground =
      std::isfinite(fall) ? std::max(low.z() - fall + kGround, low.z() - most) : low.z() - most;
  const double near = 0.5 * std::sqrt(3.0) * step;
  double free = most;
  for (double z = ground; z <= task.start.z() + most; z += step) {
    for (double y = -most; y <= most; y += step) {
      for (double x = -most; x <= most; x += step) {
        const double beside = z - std::clamp(z, low.z(), task.start.z());
        const double away = std::hypot(x, y, beside);
        if (away - near >= free) continue;
        const Vector3d at(task.start.x() + x, task.start.y() + y, z);
        if (task.surface.to(at, near) < near) free = std::max(away - near, 0.0);
      }
    }
  }
  return free;
}

}  // namespace pade::closed_loop
