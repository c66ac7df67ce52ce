// What a planner asks of a map: a constant picture of it at one moment, which any number of threads may read
// while the mapper goes on.
//
//   auto view = MapView::of(map);                         // once
//   view = view->after(map, map.integrate(image, ...));   // each frame; who holds the old one keeps it
//   const auto hit = view->sweep(path, 0.45, UnknownSpace::blocked);
//   if (hit) ...                                          // hit->length metres are clear
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string_view>
#include <utility>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "pade/core/options.hpp"
#include "pade/mapping/occupancy_map.hpp"

namespace pade::mapping {

struct TileTree;

/// What a query makes of space that nobody has seen.
enum class UnknownSpace : std::uint8_t {
  blocked,  ///< as if occupied
  free,     ///< as if free
};

/// The voxels of a box or a ball.
struct Contents {
  std::size_t occupied = 0;  ///< voxels
  std::size_t free = 0;      ///< voxels
  std::size_t unknown = 0;   ///< voxels
  double probability =
      0;  ///< that it is occupied, of the known voxel where it is highest; NaN if none is known
};

/// Where a ray or a moving ball first meets a voxel that blocks it.
struct Hit {
  double length = 0;                     ///< of the path up to there, m: as much of it is clear
  std::size_t segment = 0;               ///< of the path, which leads from point `segment` to the next
  double share = 0;                      ///< of the segment that is clear, 0 to 1
  Eigen::Vector3d place;                 ///< of the ball's centre, world, m
  Eigen::Vector3d voxel;                 ///< centre of the voxel that it meets, world, m
  Occupancy state = Occupancy::unknown;  ///< of that voxel: occupied or unknown

  /// When: by the times at the points of the path, linear between them.
  [[nodiscard]] double time(std::span<const double> times) const;
};

/// A map at one moment. Constant, so safe to read from any thread. Where nothing was seen, and outside the
/// window if it has one, all is unknown.
class MapView {
 public:
  /// All of a map: time proportional to its size.
  static std::shared_ptr<const MapView> of(const OccupancyMap& map);
  /// What of it lies in a box (world, m), rounded outwards to cubes of 8 voxels to a side: time and memory
  /// proportional to what is known there, however large the map is. Nothing where the box is empty or NaN.
  static std::shared_ptr<const MapView> of(const OccupancyMap& map, const Eigen::AlignedBox3d& window);
  /// The same view, window included, after an update of its map: time proportional to what it touched.
  [[nodiscard]] std::shared_ptr<const MapView> after(const OccupancyMap& map, const MapChange& change) const;
  /// As if the unknown voxels within `radius` of a path were free, for example where the vehicle itself is or
  /// has been: no camera sees that. Occupied ones stay. What is not finite frees nothing. Lasts until after()
  /// takes over a cube that holds them.
  [[nodiscard]] std::shared_ptr<const MapView> flown(std::span<const Eigen::Vector3d> path,
                                                     double radius) const;

  /// @{
  /// A view cannot be copied: share it.
  MapView(const MapView&) = delete;
  MapView& operator=(const MapView&) = delete;
  ~MapView();
  /// @}

  /// Side of a voxel, m.
  [[nodiscard]] double voxel() const;
  /// Bytes of memory that it takes, with what it shares with the views before and after it: time proportional
  /// to its size.
  [[nodiscard]] std::size_t memory() const;
  /// Bounds of all that is known (world, m), up to 8 voxels too large on each side; empty if nothing is.
  [[nodiscard]] Eigen::AlignedBox3d bounds() const;

  /// State of the voxel that holds a point (world, m). NaN, or beyond what the octree can address: unknown.
  [[nodiscard]] Occupancy at(const Eigen::Vector3d& point) const;
  /// Probability that it is occupied, to 0.5 %; NaN if unknown.
  [[nodiscard]] double probability(const Eigen::Vector3d& point) const;
  /// The voxels that a box (world, m) touches; none where it is empty or NaN.
  [[nodiscard]] Contents in_box(const Eigen::AlignedBox3d& box) const;
  /// The voxels that come nearer than `radius` (m) to a point (world, m); none where one of them is not
  /// finite. Time proportional to the ball.
  [[nodiscard]] Contents in_ball(const Eigen::Vector3d& centre, double radius) const;

  /// The first voxel that blocks a ray; empty if none does up to `reach`.
  /// @param origin     world, m
  /// @param direction  of any length but zero. Where it, or the origin, is not finite, or the reach is NaN,
  ///                   the ray is blocked where it begins, as by unknown space
  /// @param reach      m
  /// @param unknown    whether space that nobody has seen blocks
  [[nodiscard]] std::optional<Hit> ray(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
                                       double reach, UnknownSpace unknown) const;

  /// The first voxel that a ball meets whose centre moves along straight lines from point to point; empty if
  /// none blocks it. Exact: a voxel is met where the centre comes nearer than `radius` to its cube. Of voxels
  /// that are met at the same place an occupied one is named before an unknown one.
  /// @param path    world, m; one point is a ball at rest, no point is never blocked. A point that is not
  ///                finite blocks the path where its segment begins, as unknown space
  /// @param radius  m, above 0 and finite; any other blocks the path where it begins, as unknown space
  /// @param unknown  whether space that nobody has seen blocks
  [[nodiscard]] std::optional<Hit> sweep(std::span<const Eigen::Vector3d> path, double radius,
                                         UnknownSpace unknown) const;

  /// Calls `visitor` for every known cube in the order of OctoMap's octree: single voxels, and cubes of 2, 4,
  /// 8 and 64 to a side that are the same all over. Log-odds to 0.5 % of their range, and always on the side
  /// of the threshold that the voxel's state is on.
  void for_each_leaf(const std::function<void(const MapLeaf&)>& visitor) const;

  /// For the room's own searches.
  [[nodiscard]] const TileTree& tiles() const { return *tiles_; }

 private:
  explicit MapView(TileTree tiles, const Eigen::AlignedBox3d& window);
  std::unique_ptr<const TileTree> tiles_;
  Eigen::AlignedBox3d window_;
};

}  // namespace pade::mapping

/// As in files and on the command line.
template <>
struct pade::EnumNames<pade::mapping::UnknownSpace> {
  static constexpr std::array names = {
      ///< value and name
      std::pair{pade::mapping::UnknownSpace::blocked, std::string_view("blocked")},
      std::pair{pade::mapping::UnknownSpace::free, std::string_view("free")}};
};
