#include "pade/evaluation/map/surface.hpp"

#include <algorithm>
#include <array>
#include <limits>
#include <utility>

namespace pade::evaluation {
namespace {

constexpr std::uint32_t kLeaf = 4;

Eigen::Vector3d middle(const Triangle& t) { return (t[0] + t[1] + t[2]) / 3; }

}  // namespace

Surface::Surface(std::vector<Triangle> triangles) : triangles_(std::move(triangles)) {
  if (!triangles_.empty()) build(0, static_cast<std::uint32_t>(triangles_.size()));
}

/// Halves the triangles at the median of the longest axis of their centres.
void Surface::build(std::uint32_t first, std::uint32_t count) {
  const std::size_t at = nodes_.size();
  nodes_.emplace_back();
  Eigen::AlignedBox3d box;
  Eigen::AlignedBox3d centres;
  for (std::uint32_t i = first; i < first + count; ++i) {
    for (const Eigen::Vector3d& corner : triangles_[i]) box.extend(corner);
    centres.extend(middle(triangles_[i]));
  }
  nodes_[at].box = box;
  if (count <= kLeaf) {
    nodes_[at].first = first;
    nodes_[at].count = count;
    return;
  }
  Eigen::Index axis = 0;
  centres.sizes().maxCoeff(&axis);
  const std::uint32_t half = count / 2;
  const auto begin = triangles_.begin() + first;
  std::nth_element(begin, begin + half, begin + count, [axis](const Triangle& a, const Triangle& b) {
    return middle(a)[axis] < middle(b)[axis];
  });
  build(first, half);
  nodes_[at].first = static_cast<std::uint32_t>(nodes_.size());
  build(first + half, count - half);
}

template <class Enter, class Leaf>
void Surface::walk(const Enter& enter, const Leaf& leaf) const {
  if (nodes_.empty()) return;
  std::array<std::uint32_t, 64> waiting{};  // the tree halves: 32 levels at most
  std::size_t depth = 0;
  waiting[depth++] = 0;
  while (depth > 0) {
    const std::uint32_t at = waiting[--depth];
    const Node& node = nodes_[at];
    if (!enter(node.box)) continue;
    if (node.count == 0) {
      waiting[depth++] = node.first;
      waiting[depth++] = at + 1;
      continue;
    }
    for (std::uint32_t i = node.first; i < node.first + node.count; ++i) {
      if (!leaf(triangles_[i])) return;
    }
  }
}

PlacedSurface::PlacedSurface(const Surface& surface, const Pose& T_map_world)
    : surface_(&surface), R_map_world_(T_map_world.matrix3()), t_map_world_(T_map_world.translation) {}

/// The box in the world's axes that holds a box of the map's.
Eigen::AlignedBox3d PlacedSurface::around(const Eigen::AlignedBox3d& box) const {
  const Eigen::Vector3d centre = R_map_world_.transpose() * (box.center() - t_map_world_);
  const Eigen::Vector3d half = R_map_world_.transpose().cwiseAbs() * (0.5 * box.sizes());
  const Eigen::Vector3d rounding = 1e-9 * (Eigen::Vector3d::Ones() + centre.cwiseAbs());
  return {centre - half - rounding, centre + half + rounding};
}

Triangle PlacedSurface::placed(const Triangle& t) const {
  return {R_map_world_ * t[0] + t_map_world_, R_map_world_ * t[1] + t_map_world_,
          R_map_world_ * t[2] + t_map_world_};
}

bool PlacedSurface::overlaps(const Eigen::AlignedBox3d& box) const {
  const Eigen::AlignedBox3d world = around(box);
  bool found = false;
  surface_->walk([&](const Eigen::AlignedBox3d& node) { return node.intersects(world); },
                 [&](const Triangle& triangle) {
                   found = evaluation::overlaps(placed(triangle), box);
                   return !found;
                 });
  return found;
}

double PlacedSurface::distance(const Eigen::Vector3d& point, double limit) const {
  const Eigen::Vector3d world = R_map_world_.transpose() * (point - t_map_world_);
  double best = limit;
  bool found = false;
  surface_->walk([&](const Eigen::AlignedBox3d& node) { return node.exteriorDistance(world) <= best; },
                 [&](const Triangle& triangle) {
                   const double d = evaluation::distance(triangle, world);
                   if (d <= best) {
                     best = d;
                     found = true;
                   }
                   return true;
                 });
  return found ? best : std::numeric_limits<double>::infinity();
}

double PlacedSurface::distance(const Eigen::AlignedBox3d& box, double limit) const {
  const Eigen::AlignedBox3d world = around(box);
  double best = limit;
  bool found = false;
  surface_->walk([&](const Eigen::AlignedBox3d& node) { return node.exteriorDistance(world) <= best; },
                 [&](const Triangle& triangle) {
                   const Eigen::AlignedBox3d bounds(triangle[0].cwiseMin(triangle[1]).cwiseMin(triangle[2]),
                                                    triangle[0].cwiseMax(triangle[1]).cwiseMax(triangle[2]));
                   if (bounds.exteriorDistance(world) > best) return true;
                   const double d = evaluation::distance(placed(triangle), box);
                   if (d <= best) {
                     best = d;
                     found = true;
                   }
                   return best > 0;
                 });
  return found ? best : std::numeric_limits<double>::infinity();
}

}  // namespace pade::evaluation
