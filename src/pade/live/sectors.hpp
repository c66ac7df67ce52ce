// Distances around the vehicle as autopilots take them: OBSTACLE_DISTANCE from a map.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

#include <Eigen/Core>

#include "pade/core/camera.hpp"
#include "pade/core/options.hpp"
#include "pade/core/pose.hpp"
#include "pade/core/result.hpp"
#include "pade/core/time.hpp"
#include "pade/live/mavlink/link_messages.hpp"
#include "pade/mapping/query/map_view.hpp"

namespace pade::live {

inline constexpr std::size_t kBins = 72;                  ///< of OBSTACLE_DISTANCE
inline constexpr double kBinAngle = 5;                    ///< degrees from one bin to the next
inline constexpr std::uint16_t kUnknownDistance = 65535;  ///< nothing is said of this bin

/// Of what counts as around the vehicle.
struct SectorOptions {
  double min_distance = 0.3;  ///< m; nearer obstacles are sent as this far
  double max_distance = 20;   ///< m; farther ones are not sent
  double below = 0.5;         ///< of the slab in which obstacles count, under the body, m
  double above = 0.5;         ///< the same over it, m
  double own_radius = 1;      ///< space that nobody has seen counts as the vehicle's own up to here, m

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& field) {
    field("min_distance", self.min_distance, "m; nearer obstacles are sent as this far");
    field("max_distance", self.max_distance, "m; farther ones are not sent");
    field("below", self.below, "of the slab in which obstacles count, under the body, m");
    field("above", self.above, "the same over it, m");
    field("own_radius", self.own_radius,
          "space that nobody has seen counts as the vehicle's own up to here, m");
  }
};
/// Refuses numbers that make no sense (core/option_check.hpp).
Status check(const SectorOptions& options);

/// The bearings that a camera sees, clockwise from the body's x axis.
struct SectorView {
  double middle = 0;  ///< degrees
  double half = 180;  ///< to each side of it, degrees; 180: all around, 0: nothing

  /// What a camera sees along the middle row of its image while the body is level; nothing where that row
  /// does not cross the horizon's plane (a camera that looks down).
  static SectorView of(const Camera& camera, const Pose& T_body_camera);
};

/// Horizontal distances to the nearest occupied voxel of a level slab, in cm, rounded down.
///
/// Bin k is centred at the bearing 5 k degrees, clockwise from the body's x axis, and covers from 5 k - 5 to
/// 5 k + 10: so wide that neither PX4, which reads every other bin, nor ArduPilot, which takes a bin for the
/// 45° face of its middle, loses an obstacle. `max_distance` + 1 is sent only where every voxel of the bin
/// was seen and is free; else, without an obstacle, kUnknownDistance. What lies outside the view does not
/// count: what the map remembers there may be old. So bins outside it are unknown, and those at its edge are
/// never free. Beyond what a map can address (32768 voxels from its origin) nothing is known.
/// @param T_world_body  world ENU, body FLU; of the attitude only the heading counts
std::array<std::uint16_t, kBins> obstacle_distances(const mapping::MapView& view, const Pose& T_world_body,
                                                    const SectorOptions& options,
                                                    const SectorView& sight = {});

/// The same as a message in the body's frame.
mavlink::ObstacleDistance obstacle_distance_message(const std::array<std::uint16_t, kBins>& distances,
                                                    Time time, const SectorOptions& options);

}  // namespace pade::live
