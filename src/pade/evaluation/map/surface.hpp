// The true surface of a world as triangles in a tree of boxes: which voxels hold it, and how far it is.
#pragma once

#include <cstdint>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "pade/core/pose.hpp"
#include "pade/evaluation/map/triangle.hpp"

namespace pade::evaluation {

/// Triangles, metres, in the frame of their world. Immutable.
class Surface {
 public:
  explicit Surface(std::vector<Triangle> triangles);

  [[nodiscard]] std::size_t size() const { return triangles_.size(); }

 private:
  friend class PlacedSurface;
  struct Node {
    Eigen::AlignedBox3d box;
    std::uint32_t first = 0;  ///< of the triangles of a leaf; else the second child (the first follows)
    std::uint32_t count = 0;  ///< triangles of a leaf; 0 = an inner node
  };
  void build(std::uint32_t first, std::uint32_t count);
  /// Calls `leaf(triangle)` for the triangles of all nodes that `enter(box)` lets pass, until it returns
  /// false.
  template <class Enter, class Leaf>
  void walk(const Enter& enter, const Leaf& leaf) const;

  std::vector<Triangle> triangles_;
  std::vector<Node> nodes_;
};

/// A surface seen from another frame, such as that of a map: boxes are aligned with the axes of that frame.
/// The surface must outlive it.
class PlacedSurface {
 public:
  explicit PlacedSurface(const Surface& surface, const Pose& T_map_world = {});

  /// Whether a half-open box (triangle.hpp) holds a point of the surface.
  [[nodiscard]] bool overlaps(const Eigen::AlignedBox3d& box) const;
  /// Distance of a point, or of the nearest point of a box, from the surface, where it is at most `limit`;
  /// else infinity. Metres.
  [[nodiscard]] double distance(const Eigen::Vector3d& point, double limit) const;
  [[nodiscard]] double distance(const Eigen::AlignedBox3d& box, double limit) const;

 private:
  [[nodiscard]] Eigen::AlignedBox3d around(const Eigen::AlignedBox3d& box) const;
  [[nodiscard]] Triangle placed(const Triangle& triangle) const;

  const Surface* surface_;
  Eigen::Matrix3d R_map_world_;
  Eigen::Vector3d t_map_world_;
};

}  // namespace pade::evaluation
