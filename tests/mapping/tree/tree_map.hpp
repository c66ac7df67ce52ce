// The map on OctoMap's octree, voxel by voxel and point by point: what the map in tiles is held to.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "pade/core/camera.hpp"
#include "pade/core/depth_image.hpp"
#include "pade/core/options.hpp"
#include "pade/core/pose.hpp"
#include "pade/core/result.hpp"
#include "pade/mapping/occupancy_map.hpp"

namespace octomap {
class OcTreeNode;
}

namespace pade::mapping::tree {

/// Occupied, free and unknown space.
class TreeMap {
 public:
  /// Refuses options that make no sense; the message names the option.
  static Result<TreeMap> create(const MapOptions& options = {});
  /// A map around an existing tree, for example one that was read from a file. The voxel size is the tree's.
  static Result<TreeMap> create(const MapOptions& options, std::unique_ptr<octomap::OcTree> tree);

  /// @{
  /// What was moved from can only be assigned to or destroyed.
  TreeMap(TreeMap&&) noexcept;
  TreeMap& operator=(TreeMap&&) noexcept;
  /// @}
  TreeMap(const TreeMap&) = delete;
  TreeMap& operator=(const TreeMap&) = delete;
  ~TreeMap();

  /// As given to create(), but for the voxel size of a tree that was read.
  [[nodiscard]] const MapOptions& options() const { return options_; }

  /// Fuses one depth image. Each voxel gets at most one hit or one miss. Same images in the same order, same
  /// bits.
  /// - Hit: the voxel holds the points of enough pixels with Z <= range and sigma <= hit_max_relative_sigma
  /// Z: enough for its size in the image, and not far fewer than the voxels before and behind it. A hit
  /// nearer than hit_near whose pixels' own sigma is no more than a voxel counts at once, others wait until
  /// looks from other places agree.
  /// - Miss: every pixel that sees the voxel has its bound (or, in an image without bounds, Z - k sigma)
  /// behind the whole voxel, in this image and in one of the last few from at least looks_baseline away.
  /// Pixels that know nothing, or see less far, leave what lies behind them unknown, but for spots whose size
  /// is below free_hole there.
  /// @param image           variance empty = depth is exact; own_variance empty = variance; state empty =
  /// measured wherever there is depth; bound empty = Z - k sigma of measured pixels
  /// @param camera          pinhole of the image at full size (its distortion is ignored)
  /// @param T_world_camera  metres; must be finite
  MapChange integrate(const DepthImage& image, const Camera& camera, const Pose& T_world_camera);

  /// State of the voxel that holds a point (world, m). Beyond what the octree can address: unknown.
  [[nodiscard]] Occupancy at(const Eigen::Vector3d& point) const;
  /// Probability that it is occupied; NaN if unknown.
  [[nodiscard]] double probability(const Eigen::Vector3d& point) const;

  /// Calls `visitor` for every known cell, in the order of the octree.
  void for_each(const std::function<void(const MapCell&, Occupancy)>& visitor) const;
  /// Occupied cells, in the order of the octree.
  [[nodiscard]] std::vector<MapCell> occupied() const;
  /// Bounds of all known cells; empty if nothing is known.
  [[nodiscard]] Eigen::AlignedBox3d bounds() const;
  /// Voxels that are known; a cube counts as all its voxels.
  struct Counts {
    std::size_t occupied = 0;  ///< of all known voxels, those that are occupied
    std::size_t free = 0;      ///< the rest of them
  };
  /// Counts the whole map: time proportional to its size.
  [[nodiscard]] Counts counts() const;

  /// For what OctoMap, dynamicEDT3D and FCL do with a tree.
  [[nodiscard]] const octomap::OcTree& tree() const;

 private:
  class Tree;
  struct Scratch;
  explicit TreeMap(const MapOptions& options);
  [[nodiscard]] const octomap::OcTreeNode* find(const Eigen::Vector3d& point) const;
  struct HitVoxel;
  void count_points(const DepthImage& image, const Camera& cells, const Pose& T_world_camera,
                    MapChange& change);
  [[nodiscard]] bool is_hit(const HitVoxel& voxel) const;
  void find_hits(const Camera& cells, const Pose& T_world_camera);
  [[nodiscard]] bool is_on_the_peak(const HitVoxel& voxel, float weight) const;
  [[nodiscard]] float believed(const HitVoxel& voxel);
  void believe_hits(MapChange& change);
  void find_free(MapChange& change);
  void arrive_at(const Eigen::Vector3d& place);
  void remember_view();

  MapOptions options_;
  std::unique_ptr<Tree> tree_;
  std::unique_ptr<Scratch> scratch_;  // kept between images, so that the frame loop does not allocate
};

}  // namespace pade::mapping::tree
