// The map about the vehicle as bits, one per voxel: for which centres a ball touches nothing occupied, or
// nothing but what is known to be free.
#pragma once

#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "pade/mapping/query/map_view.hpp"

namespace pade::mapping {
struct Tile;
}

namespace pade::planning {

/// A box of voxels that follows the vehicle. Buffers are kept from call to call.
class LocalWindow {
 public:
  /// Half the size of the box, m; the box is that or up to a tile of 8 voxels more to a side.
  explicit LocalWindow(const Eigen::Vector3d& half_size = {6.4, 6.4, 1.6}) : half_size_(half_size) {}

  /// Takes the map about `centre`, and finds where a ball of `radius` (m) fits: wherever in the voxel its
  /// centre is. What lies beyond the box is unknown.
  void set(const mapping::MapView& map, const Eigen::Vector3d& centre, double radius);

  /// Whether a ball about this point (world, m) touches nothing that is known to be occupied.
  [[nodiscard]] bool is_clear(const Eigen::Vector3d& point) const {
    return !bit(occupied_near_, point, false);
  }
  /// Whether it touches nothing but what is known to be free.
  [[nodiscard]] bool is_free(const Eigen::Vector3d& point) const { return !bit(unfree_near_, point, true); }
  /// State of the voxel that holds the point; unknown beyond the box.
  [[nodiscard]] mapping::Occupancy at(const Eigen::Vector3d& point) const;

  [[nodiscard]] double voxel() const { return voxel_; }
  /// The lower corner of the box, m.
  [[nodiscard]] Eigen::Vector3d corner() const { return voxel_ * first_.cast<double>(); }
  /// Voxels along the axes.
  [[nodiscard]] const Eigen::Vector3i& size() const { return size_; }

 private:
  using Bits = std::vector<std::uint64_t>;  // rows along x, of words_ words; then y, then z
  void resize(const Eigen::Vector3d& centre);
  void take(const mapping::MapView& map);
  void copy(const mapping::Tile& tile, const Eigen::Vector3i& corner);
  void spread(const Bits& from, double radius, bool beyond, Bits& to);
  void spread_rows(const Bits& from, int reach, bool beyond);
  [[nodiscard]] std::size_t row(int y, int z) const {
    return static_cast<std::size_t>((z * size_.y() + y) * words_);
  }
  [[nodiscard]] bool bit(const Bits& bits, const Eigen::Vector3d& point, bool beyond) const;

  Eigen::Vector3d half_size_;
  double voxel_ = 0.1;
  Eigen::Vector3i first_ = Eigen::Vector3i::Zero();  // index of the voxel at the lower corner
  Eigen::Vector3i size_ = Eigen::Vector3i::Zero();
  int words_ = 0;
  Bits free_, occupied_, unfree_, occupied_near_, unfree_near_, rows_;
};

}  // namespace pade::planning
