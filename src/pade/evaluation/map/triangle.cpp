#include "pade/evaluation/map/triangle.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace pade::evaluation {
namespace {

using Eigen::Vector3d;

/// True where the projections of the triangle and of a box of that half extent about the origin do not meet.
bool separates(const Vector3d& axis, const Triangle& t, const Vector3d& half) {
  const double p0 = axis.dot(t[0]);
  const double p1 = axis.dot(t[1]);
  const double p2 = axis.dot(t[2]);
  const double reach = half.dot(axis.cwiseAbs());
  return std::min({p0, p1, p2}) > reach || std::max({p0, p1, p2}) < -reach;
}

/// The three axes of the box, with its faces open or closed as stated.
bool apart_along_the_box(const Triangle& t, const Eigen::AlignedBox3d& box, bool open_above) {
  const Vector3d low = t[0].cwiseMin(t[1]).cwiseMin(t[2]);
  const Vector3d high = t[0].cwiseMax(t[1]).cwiseMax(t[2]);
  for (int axis = 0; axis < 3; ++axis) {
    if (high[axis] < box.min()[axis] || low[axis] > box.max()[axis]) return true;
    if (open_above && low[axis] >= box.max()[axis]) return true;
  }
  return false;
}

bool meets(const Triangle& triangle, const Eigen::AlignedBox3d& box, bool open_above) {
  if (apart_along_the_box(triangle, box, open_above)) return false;
  const Vector3d centre = box.center();
  const Vector3d half = 0.5 * box.sizes();
  const Triangle t = {triangle[0] - centre, triangle[1] - centre, triangle[2] - centre};
  const std::array<Vector3d, 3> edges = {t[1] - t[0], t[2] - t[1], t[0] - t[2]};
  if (separates(edges[0].cross(edges[1]), t, half)) return false;
  for (const Vector3d& edge : edges) {
    for (int axis = 0; axis < 3; ++axis) {
      if (separates(Vector3d::Unit(axis).cross(edge), t, half)) return false;
    }
  }
  return true;
}

double squared_distance(const Triangle& triangle, const Vector3d& p) {
  const auto& [a, b, c] = triangle;
  const Vector3d ab = b - a;
  const Vector3d ac = c - a;
  const double d1 = ab.dot(p - a);
  const double d2 = ac.dot(p - a);
  if (d1 <= 0 && d2 <= 0) return (p - a).squaredNorm();
  const double d3 = ab.dot(p - b);
  const double d4 = ac.dot(p - b);
  if (d3 >= 0 && d4 <= d3) return (p - b).squaredNorm();
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return (p - a - d1 / (d1 - d3) * ab).squaredNorm();
  const double d5 = ab.dot(p - c);
  const double d6 = ac.dot(p - c);
  if (d6 >= 0 && d5 <= d6) return (p - c).squaredNorm();
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return (p - a - d2 / (d2 - d6) * ac).squaredNorm();
  const double va = d3 * d6 - d5 * d4;
  if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) {
    return (p - b - (d4 - d3) / ((d4 - d3) + (d5 - d6)) * (c - b)).squaredNorm();
  }
  const double sum = va + vb + vc;
  return (p - a - vb / sum * ab - vc / sum * ac).squaredNorm();
}

/// Squared distance of two segments p + s d1, q + t d2 with s, t in [0, 1] (Ericson 5.1.9).
double squared_distance_of_segments(const Vector3d& p, const Vector3d& d1, const Vector3d& q,
                                    const Vector3d& d2) {
  const Vector3d r = p - q;
  const double a = d1.squaredNorm();
  const double e = d2.squaredNorm();
  const double f = d2.dot(r);
  double s = 0;
  double t = 0;
  if (a > 0 && e > 0) {
    const double c = d1.dot(r);
    const double b = d1.dot(d2);
    const double denominator = a * e - b * b;
    if (denominator > 1e-14 * a * e) s = std::clamp((b * f - c * e) / denominator, 0.0, 1.0);
    t = (b * s + f) / e;
    if (t < 0 || t > 1) {
      t = std::clamp(t, 0.0, 1.0);
      s = std::clamp((b * t - c) / a, 0.0, 1.0);
    }
  } else if (a > 0) {
    s = std::clamp(-d1.dot(r) / a, 0.0, 1.0);
  } else if (e > 0) {
    t = std::clamp(f / e, 0.0, 1.0);
  }
  return (r + s * d1 - t * d2).squaredNorm();
}

Vector3d corner_of(const Eigen::AlignedBox3d& box, int index) {
  return box.corner(static_cast<Eigen::AlignedBox3d::CornerType>(index));
}

}  // namespace

bool overlaps(const Triangle& triangle, const Eigen::AlignedBox3d& box) { return meets(triangle, box, true); }

double distance(const Triangle& triangle, const Eigen::Vector3d& point) {
  return std::sqrt(squared_distance(triangle, point));
}

double distance(const Triangle& triangle, const Eigen::AlignedBox3d& box) {
  if (meets(triangle, box, false)) return 0;
  // Two convex bodies apart are nearest at a corner of one of them or between two edges.
  double best = std::numeric_limits<double>::infinity();
  for (const Vector3d& corner : triangle) best = std::min(best, box.squaredExteriorDistance(corner));
  for (int i = 0; i < 8; ++i) best = std::min(best, squared_distance(triangle, corner_of(box, i)));
  for (int axis = 0; axis < 3; ++axis) {
    const Vector3d along = box.sizes()[axis] * Vector3d::Unit(axis);
    for (int i = 0; i < 8; ++i) {
      if (((i >> axis) & 1) != 0) continue;
      for (std::size_t edge = 0; edge < 3; ++edge) {
        const Vector3d& from = triangle[edge];
        best = std::min(best, squared_distance_of_segments(corner_of(box, i), along, from,
                                                           triangle[(edge + 1) % 3] - from));
      }
    }
  }
  return std::sqrt(best);
}

}  // namespace pade::evaluation
