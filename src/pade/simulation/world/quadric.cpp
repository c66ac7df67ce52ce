#include "pade/simulation/world/quadric.hpp"

#include <algorithm>
#include <cmath>

namespace pade::simulation {

Quadric Quadric::make(Kind kind, const Pose& T_world_shape, const Eigen::Vector3d& centre,
                      const Eigen::Vector3d& half_extent) {
  Quadric quadric;
  quadric.kind = kind;
  quadric.T_world_unit = Eigen::Translation3d(T_world_shape.translation) * T_world_shape.rotation *
                         Eigen::Translation3d(centre) * Eigen::Scaling(half_extent);
  quadric.T_unit_world = quadric.T_world_unit.inverse();
  return quadric;
}

std::optional<Quadric::Hit> Quadric::intersect(const Eigen::Vector3d& origin,
                                               const Eigen::Vector3d& direction, double nearest,
                                               double farthest) const {
  const Eigen::Vector3d o = T_unit_world * origin;
  const Eigen::Vector3d d = T_unit_world.linear() * direction;
  std::optional<Hit> best;
  const auto offer = [&](double t, Part part) {
    if (t > nearest && t < farthest && (!best || t < best->distance)) best = Hit{t, part};
  };
  const bool round_in_z = kind == Kind::sphere;
  const double a = d.head<2>().squaredNorm() + (round_in_z ? d.z() * d.z() : 0);
  if (a > 0) {
    // Foot of the perpendicular first: b^2 - a c would cancel for a small shape far away.
    const double dot = o.head<2>().dot(d.head<2>()) + (round_in_z ? o.z() * d.z() : 0);
    const double foot = -dot / a;
    const Eigen::Vector3d at_foot = o + foot * d;
    const double c = at_foot.head<2>().squaredNorm() + (round_in_z ? at_foot.z() * at_foot.z() : 0) - 1;
    if (c <= 0) {
      const double half_chord = std::sqrt(-c / a);
      for (const double t : {foot - half_chord, foot + half_chord}) {
        if (round_in_z || std::abs(o.z() + t * d.z()) <= 1) offer(t, Part::curved);
      }
    }
  }
  if (kind == Kind::cylinder && d.z() != 0) {
    for (const double z : {-1.0, 1.0}) {
      const double t = (z - o.z()) / d.z();
      if ((o + t * d).head<2>().squaredNorm() <= 1) offer(t, Part::cap);
    }
  }
  return best;
}

Eigen::Vector3d Quadric::normal(const Eigen::Vector3d& unit_point, Part part) const {
  Eigen::Vector3d n = unit_point;
  if (part == Part::cap) {
    n = {0, 0, unit_point.z() > 0 ? 1.0 : -1.0};
  } else if (kind != Kind::sphere) {
    n.z() = 0;
  }
  return (T_unit_world.linear().transpose() * n).normalized();
}

Eigen::AlignedBox3d Quadric::bounds(double from, double to) const {
  // The half extent of an ellipsoid along a world axis is the norm of that row; of a cylinder, disc plus
  // axis.
  const Eigen::Matrix3d m = T_world_unit.linear();
  Eigen::Vector3d half;
  for (int i = 0; i < 3; ++i) {
    half[i] = kind == Kind::sphere ? m.row(i).norm()
                                   : m.row(i).head<2>().norm() + 0.5 * (to - from) * std::abs(m(i, 2));
  }
  Eigen::Vector3d centre = T_world_unit.translation();
  if (kind != Kind::sphere) centre += 0.5 * (from + to) * m.col(2);
  return {centre - half, centre + half};
}

int Quadric::pieces() const {
  if (kind == Kind::sphere) return 1;
  constexpr int kMost = 32;
  constexpr double kShortest = 0.3;  // metres
  const Eigen::Matrix3d m = T_world_unit.linear();
  const double width = m.col(0).norm() + m.col(1).norm();
  Eigen::Vector3d extent = 2 * m.col(2).cwiseAbs();
  std::sort(extent.data(), extent.data() + 3);
  if (extent[1] < 4 * width) return 1;  // nearly along an axis
  const double length = 2 * m.col(2).norm();
  return std::clamp(static_cast<int>(length / std::max(4 * width, kShortest)), 1, kMost);
}

}  // namespace pade::simulation
