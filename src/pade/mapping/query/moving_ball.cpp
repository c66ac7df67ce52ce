#include "pade/mapping/query/moving_ball.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace pade::mapping {

Eigen::AlignedBox3d BallPath::bounds() const {
  Eigen::AlignedBox3d box(start);
  box.extend(at(length));
  return {box.min().array() - radius, box.max().array() + radius};
}

double BallPath::squared_distance(const Eigen::Vector3d& point) const {
  const double s = std::clamp((point - start).dot(direction), 0.0, length);
  return (point - at(s)).squaredNorm();
}

namespace {

/// a s^2 + 2 b s + c
struct Parabola {
  double a = 0, b = 0, c = 0;
  [[nodiscard]] double at(double s) const { return (a * s + 2 * b) * s + c; }
};

/// The squared distance from the box, as it is around s.
Parabola distance_around(double s, const BallPath& path, const Eigen::AlignedBox3d& box) {
  Parabola sum;
  for (int axis = 0; axis < 3; ++axis) {
    const double d = path.direction[axis];
    const double p = path.start[axis];
    const double x = p + s * d;
    const double to = x < box.min()[axis] ? box.min()[axis] : x > box.max()[axis] ? box.max()[axis] : x;
    if (to == x) continue;
    sum.a += d * d;
    sum.b += d * (p - to);
    sum.c += (p - to) * (p - to);
  }
  return sum;
}

}  // namespace

std::optional<double> BallPath::first_contact(const Eigen::AlignedBox3d& box) const {
  std::array<double, 8> ends{0, length};
  std::size_t count = 2;
  for (int axis = 0; axis < 3; ++axis) {
    if (direction[axis] == 0) continue;
    for (const double plane : {box.min()[axis], box.max()[axis]}) {
      const double s = (plane - start[axis]) / direction[axis];
      if (!(s > 0 && s < length)) continue;
      std::size_t place = count++;
      for (; ends[place - 1] > s; --place) ends[place] = ends[place - 1];
      ends[place] = s;
    }
  }
  const double limit = radius * radius;
  for (std::size_t i = 0; i + 1 < count; ++i) {
    const double from = ends[i];
    const double to = ends[i + 1];
    const Parabola q = distance_around(0.5 * (from + to), *this, box);
    if (q.at(from) < limit) return from;
    const double root = q.b * q.b - q.a * (q.c - limit);
    if (!(q.a > 0 && root > 0)) continue;
    const double s = (-q.b - std::sqrt(root)) / q.a;
    if (s >= from && s <= to) return s;
  }
  return std::nullopt;
}

}  // namespace pade::mapping
