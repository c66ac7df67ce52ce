// The obstacle map: occupancy in log-odds (Hornung et al., "OctoMap", Autonomous Robots 2013) in tiles of
// voxels, fed with depth images whose uncertainty is known per pixel. How a depth image enters the map is
// derived in docs/mapping.md.
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

// OctoMap's headers cost more than all of this one: whoever uses octree() includes <octomap/OcTree.h>.
namespace octomap {
class OcTree;
}  // namespace octomap

namespace pade::mapping {

/// How depth becomes occupancy.
struct MapOptions {
  double voxel = 0.1;                ///< side of a voxel, m
  double range = 20;                 ///< depth Z up to which the map is updated, m
  double p_hit = 0.7;                ///< occupancy of a voxel after one hit on an unknown one
  double p_miss = 0.4;               ///< after one miss
  double clamp_min = 0.1192;         ///< least occupancy: how soon the map notices what has come
  double clamp_max = 0.971;          ///< greatest: how soon it forgets what has gone
  double occupancy_threshold = 0.5;  ///< occupied at and above
  double free_margin_sigmas = 2;     ///< a ray is free up to Z - this many sigma
  double free_hole = 0.1;            ///< what is smaller is not looked for, m
  double looks_baseline = 0.1;  ///< between the places of the two looks that make a voxel free, and of those
                                ///< that confirm a far or uncertain hit, m; 0 = one look is enough
  double forget_after =
      0;  ///< free voxels that are not seen free for so long are unknown again, s; 0 = never
  /// What is farther from the camera is kept packed, in about a tenth of the memory, until the vehicle comes
  /// back or somebody asks for it; nothing else changes. Then const functions too must not run side by side.
  /// m; 0 = never
  double pack_beyond = 0;
  double hit_max_relative_sigma = 0.25;  ///< depths with sigma above this share of Z place no obstacle
  double hit_near = 8;                   ///< hits at this depth and beyond wait for a second look, m
  double hit_min_share = 0.05;           ///< of the pixels that a voxel covers in the image, to count as hit
  double hit_min_of_peak = 0.5;          ///< of the points of the fullest neighbour, to count as hit

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
    field("free_hole", self.free_hole,
          "spots of short or unknown sight that hide nothing larger than this count as free, m; 0 = none");
    field("looks_baseline", self.looks_baseline,
          "between two looks that make a voxel free or confirm a far or uncertain hit, m; 0 = one look is "
          "enough");
    field("forget_after", self.forget_after,
          "free voxels that are not seen free for so long are unknown again, s; 0 = never");
    field("pack_beyond", self.pack_beyond,
          "what is farther from the camera is kept packed, in less memory and with the same content, m; 0 = "
          "never");
    field("hit_max_relative_sigma", self.hit_max_relative_sigma,
          "depths with sigma above this share of Z place no obstacle");
    field("hit_near", self.hit_near, "hits at this depth and beyond wait for a second look, m");
    field("hit_min_share", self.hit_min_share, "share of a voxel's pixels that make a hit");
    field("hit_min_of_peak", self.hit_min_of_peak, "share of the fullest neighbour's points that make a hit");
  }
};

/// Refuses numbers that make no sense (core/option_check.hpp).
Status check(const MapOptions& options);

/// Levels of the octree: a voxel is a cell at this depth.
inline constexpr unsigned kTreeDepth = 16;

/// State of a voxel.
enum class Occupancy : std::uint8_t {
  unknown,   ///< never seen: neither free nor occupied
  free,      ///< seen through, its occupancy below the threshold
  occupied,  ///< its occupancy at or above the threshold
};

/// A voxel, or a cube of 2^k voxels to a side that all have the same state.
struct MapCell {
  std::array<std::uint16_t, 3> key{};  ///< OctoMap's, of the voxel at the lower corner of the cube
  unsigned depth = 16;                 ///< in the octree; 16 = one voxel
  Eigen::Vector3f centre;              ///< world, m
  float side = 0;                      ///< m
};

/// What one depth image changed. In order of position (Morton order), each place once.
struct MapChange {
  std::vector<MapCell> became_occupied;  ///< from unknown or from free
  std::vector<MapCell> became_free;      ///< from unknown or from occupied
  /// From free, not seen for MapOptions::forget_after. Comes before the other two: what is forgotten and seen
  /// again at once is in both.
  std::vector<MapCell> became_unknown;
  /// Cubes of 8 voxels to a side, or larger ones, in which an occupancy may have changed: what a MapView
  /// takes over.
  std::vector<MapCell> touched;
  std::size_t hits = 0;          ///< voxels that got a hit
  std::size_t pending_hits = 0;  ///< voxels, of this image and earlier ones, that wait for another look
  /// Voxels that this image shows free, and no earlier one from another place; without those that the map
  /// holds for as free as can be.
  std::size_t pending_free = 0;
  std::size_t too_uncertain = 0;  ///< pixels whose sigma is above hit_max_relative_sigma
  std::size_t outside = 0;  ///< points beyond what the octree can address (32768 voxels from the origin)
};

class VoxelStore;
struct HitVoxel;

/// What is known of a voxel, or of a cube of 2^k voxels to a side that all have the same log-odds.
struct MapLeaf {
  std::uint64_t code = 0;    ///< bits of the key of its lower corner interleaved, x lowest
  unsigned depth = 16;       ///< in the octree; 16 = one voxel
  float log_odds = 0;        ///< of its occupancy
  bool is_occupied = false;  ///< at or above the threshold
};

/// Occupied, free and unknown space.
class OccupancyMap {
 public:
  /// Refuses options that make no sense; the message names the option.
  static Result<OccupancyMap> create(const MapOptions& options = {});
  /// A map with the content of a tree, for example one that was read from a file. The voxel size is the
  /// tree's.
  static Result<OccupancyMap> create(const MapOptions& options, std::unique_ptr<octomap::OcTree> tree);

  /// @{
  /// What was moved from can only be assigned to or destroyed.
  OccupancyMap(OccupancyMap&&) noexcept;
  OccupancyMap& operator=(OccupancyMap&&) noexcept;
  /// @}
  OccupancyMap(const OccupancyMap&) = delete;
  OccupancyMap& operator=(const OccupancyMap&) = delete;
  ~OccupancyMap();

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
  /// @param T_world_camera  metres
  ///
  /// Where the pose or the camera is none (NaN, no rotation, no focal length) nothing changes.
  MapChange integrate(const DepthImage& image, const Camera& camera, const Pose& T_world_camera);

  /// Time goes on without a depth image: with MapOptions::forget_after free voxels become unknown that were
  /// last seen free longer ago, by a quarter of it at most; integrate() does the same. What came from a file,
  /// or was seen before the option was set, stays.
  /// @param now  not before the last image
  MapChange forget(Time now);

  /// State of the voxel that holds a point (world, m). Beyond what the octree can address: unknown.
  [[nodiscard]] Occupancy at(const Eigen::Vector3d& point) const;
  /// Probability that it is occupied; NaN if unknown.
  [[nodiscard]] double probability(const Eigen::Vector3d& point) const;

  /// Calls `visitor` for every known cell, as large as can be, in the order of OctoMap's octree.
  void for_each(const std::function<void(const MapCell&, Occupancy)>& visitor) const;
  /// The same with log-odds: what a file is made of.
  void for_each_leaf(const std::function<void(const MapLeaf&)>& visitor) const;
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

  /// A tree of OctoMap's with the same content, made anew: for what OctoMap, dynamicEDT3D and FCL do with
  /// one.
  [[nodiscard]] std::unique_ptr<octomap::OcTree> octree() const;
  /// Bytes of memory that the voxels take, packed ones included.
  [[nodiscard]] std::size_t memory() const;

  /// For the room's own searches.
  [[nodiscard]] const VoxelStore& voxels() const { return *voxels_; }

 private:
  struct Scratch;
  explicit OccupancyMap(const MapOptions& options);
  [[nodiscard]] bool is_on_the_peak(const HitVoxel& voxel, float weight) const;
  [[nodiscard]] float believed(const HitVoxel& voxel);
  void believe_hits(MapChange& change);
  void find_free(MapChange& change);
  void arrive_at(const Eigen::Vector3d& place);
  void pack_far(const Eigen::Vector3d& place);
  void remember_view();

  MapOptions options_;
  std::unique_ptr<VoxelStore> voxels_;
  std::unique_ptr<Scratch> scratch_;  // kept between images, so that the frame loop does not allocate
};

}  // namespace pade::mapping
