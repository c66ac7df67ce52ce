// The obstacle map: occupancy in an OctoMap octree (Hornung et al., "OctoMap", Autonomous Robots 2013), fed
// with depth images whose uncertainty is known per pixel. How a depth image enters the map is derived in
// docs/mapping.md.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <octomap/OcTree.h>

#include "pade/core/camera.hpp"
#include "pade/core/depth_image.hpp"
#include "pade/core/options.hpp"
#include "pade/core/pose.hpp"
#include "pade/core/result.hpp"

namespace pade::mapping {

/// How depth becomes occupancy.
struct MapOptions {
  double voxel = 0.1;         ///< side of a voxel, m
  double range = 20;          ///< depth Z up to which the map is updated, m
  double p_hit = 0.7;         ///< occupancy of a voxel after one hit on an unknown one
  double p_miss = 0.4;        ///< after one miss
  double clamp_min = 0.1192;  ///< bounds of the occupancy: how soon the map forgets
  double clamp_max = 0.971;
  double occupancy_threshold = 0.5;  ///< occupied at and above
  double free_margin_sigmas = 2;     ///< a ray is free up to Z - this many sigma
  double hit_max_sigma = 0.2;        ///< depths less certain than this place no obstacle, m
  double hit_min_share = 0.05;       ///< of the pixels that a voxel covers in the image, to count as hit
  double hit_min_of_peak = 0.5;      ///< of the points of the fullest neighbour, to count as hit
  double free_min_known = 0.75;  ///< of the pixels that a voxel covers, how many must have depth to clear it

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& field) {
    field("voxel", self.voxel, "side of a voxel, m");
    field("range", self.range, "depth up to which the map is updated, m");
    field("p_hit", self.p_hit, "occupancy of an unknown voxel after one hit");
    field("p_miss", self.p_miss, "occupancy of an unknown voxel after one miss");
    field("clamp_min", self.clamp_min, "lower bound of the occupancy");
    field("clamp_max", self.clamp_max, "upper bound of the occupancy");
    field("occupancy_threshold", self.occupancy_threshold, "a voxel is occupied at and above");
    field("free_margin_sigmas", self.free_margin_sigmas, "k: a ray is free up to Z - k sigma");
    field("hit_max_sigma", self.hit_max_sigma, "depths less certain than this place no obstacle, m");
    field("hit_min_share", self.hit_min_share, "share of a voxel's pixels that make a hit");
    field("hit_min_of_peak", self.hit_min_of_peak, "share of the fullest neighbour's points that make a hit");
    field("free_min_known", self.free_min_known,
          "share of a voxel's pixels that must have depth to clear it");
  }
};

inline constexpr unsigned kTreeDepth = 16;

enum class Occupancy : std::uint8_t { unknown, free, occupied };

/// A voxel, or a cube of 2^k voxels to a side that all have the same state.
struct MapCell {
  octomap::OcTreeKey key;  ///< of the voxel at the lower corner of the cube
  unsigned depth = 16;     ///< in the octree; 16 = one voxel
  Eigen::Vector3f centre;  ///< world, m
  float side = 0;          ///< m
};

/// What one depth image changed. In order of position (Morton order), each place once.
struct MapChange {
  std::vector<MapCell> became_occupied;
  std::vector<MapCell> became_free;  ///< from unknown or from occupied
  std::size_t hits = 0;              ///< voxels that got a hit
  std::size_t outside = 0;  ///< points beyond what the octree can address (32768 voxels from the origin)
};

/// Occupied, free and unknown space.
class OccupancyMap {
 public:
  /// Refuses options that make no sense; the message names the option.
  static Result<OccupancyMap> create(const MapOptions& options = {});
  /// A map around an existing tree, for example one that was read from a file. The voxel size is the tree's.
  static Result<OccupancyMap> create(const MapOptions& options, std::unique_ptr<octomap::OcTree> tree);

  OccupancyMap(OccupancyMap&&) noexcept;
  OccupancyMap& operator=(OccupancyMap&&) noexcept;
  OccupancyMap(const OccupancyMap&) = delete;
  OccupancyMap& operator=(const OccupancyMap&) = delete;
  ~OccupancyMap();

  [[nodiscard]] const MapOptions& options() const { return options_; }

  /// Fuses one depth image. Each voxel gets at most one hit or one miss. Same images in the same order, same
  /// bits.
  /// - Hit: the voxel holds the points of enough pixels with Z <= range and sigma <= hit_max_sigma: enough
  /// for its
  ///   size in the image, and not far fewer than the voxels before and behind it (which noise has spread
  ///   there).
  /// - Miss: every pixel that sees the voxel has measured, and Z - k sigma of all of them lies behind the
  /// whole voxel. Pixels that are not `measured`, or whose depth or variance is NaN, change nothing.
  /// @param image           variance empty = depth is exact; state empty = measured wherever there is depth
  /// @param camera          pinhole of the image at full size (its distortion is ignored)
  /// @param T_world_camera  metres; must be finite
  MapChange integrate(const DepthImage& image, const Camera& camera, const Pose& T_world_camera);

  /// State of the voxel that holds a point (world, m). Beyond what the octree can address: unknown.
  [[nodiscard]] Occupancy at(const Eigen::Vector3d& point) const;
  /// Probability that it is occupied; NaN where unknown.
  [[nodiscard]] double probability(const Eigen::Vector3d& point) const;

  /// Calls `visitor` for every known cell, in the order of the octree.
  void for_each(const std::function<void(const MapCell&, Occupancy)>& visitor) const;
  /// Occupied cells, in the order of the octree.
  [[nodiscard]] std::vector<MapCell> occupied() const;
  /// Bounds of all known cells; empty where nothing is known.
  [[nodiscard]] Eigen::AlignedBox3d bounds() const;
  struct Counts {
    std::size_t occupied = 0, free = 0;  ///< voxels; a cube counts as all its voxels
  };
  [[nodiscard]] Counts counts() const;

  /// For what OctoMap, dynamicEDT3D and FCL do with a tree.
  [[nodiscard]] const octomap::OcTree& tree() const;

 private:
  class Tree;
  struct Scratch;
  explicit OccupancyMap(const MapOptions& options);
  [[nodiscard]] const octomap::OcTreeNode* find(const Eigen::Vector3d& point) const;
  [[nodiscard]] bool is_hit(const octomap::OcTreeKey& key, std::uint32_t count, const Camera& cells,
                            const Pose& T_world_camera) const;
  std::size_t find_hits(const DepthImage& image, const Camera& camera, const Pose& T_world_camera);

  MapOptions options_;
  std::unique_ptr<Tree> tree_;
  std::unique_ptr<Scratch> scratch_;  // kept between images, so that the frame loop does not allocate
};

}  // namespace pade::mapping
