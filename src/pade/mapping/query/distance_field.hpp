// How far it is from each voxel of a box to the nearest one that blocks, exact: one pass along each axis, by
// integers (Saito and Toriwaki, "New algorithms for Euclidean distance transformation", 1994), rows side by
// side in vector registers.
#pragma once

#include <cstdint>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "pade/mapping/query/map_view.hpp"

namespace pade::mapping {

/// Distances between centres of voxels. Only what lies in the box counts: from a voxel nearer to the border
/// of the box than the distance, something outside may be nearer. A whole box is made anew each time.
class DistanceField {
 public:
  /// @param box   world, m, rounded outwards to voxels; at most 2000 voxels along each axis are taken
  /// @param most  m; farther counts as this far
  static DistanceField of(const MapView& view, const Eigen::AlignedBox3d& box, UnknownSpace unknown,
                          double most = 5);

  /// Voxels along each axis.
  [[nodiscard]] const Eigen::Vector3i& size() const { return size_; }
  /// From the centre of a voxel (counted from the lower corner of the box) to that of the nearest one that
  /// blocks, m.
  [[nodiscard]] double at(const Eigen::Vector3i& voxel) const;
  /// Centre of a voxel, world, m.
  [[nodiscard]] Eigen::Vector3d centre(const Eigen::Vector3i& voxel) const;
  /// Between the centres of voxels linearly, m; at the border as at the nearest centre. NaN outside the box.
  [[nodiscard]] double distance(const Eigen::Vector3d& point) const;
  /// Of distance(), m per m: where to go to get away. NaN outside the box.
  [[nodiscard]] Eigen::Vector3d gradient(const Eigen::Vector3d& point) const;

 private:
  struct Cell {
    std::array<double, 8> distance;  ///< at the corners, x lowest
    Eigen::Vector3d share;           ///< of the way between them
  };
  [[nodiscard]] bool cell_at(const Eigen::Vector3d& point, Cell& cell) const;

  Eigen::Vector3i size_ = Eigen::Vector3i::Zero();
  Eigen::Vector3d corner_ = Eigen::Vector3d::Zero();  ///< of the box, world, m
  double voxel_ = 0;
  int stride_ = 0;  ///< from row to row
  /// Squared, voxels, x fastest; one of them is used: 16 bits where they hold the farthest.
  std::vector<std::int16_t> near_;
  std::vector<std::int32_t> far_;
};

}  // namespace pade::mapping
