// How an occupancy map compares with the world that it is a map of: surface voxels that are occupied, free or
// unknown, phantoms, and what lies ahead of the vehicle. docs/map-evaluation.md defines every measure.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "pade/core/camera.hpp"
#include "pade/core/pose.hpp"
#include "pade/evaluation/map/surface.hpp"
#include "pade/mapping/occupancy_map.hpp"

namespace pade::evaluation {

/// A voxel: floor(coordinate / side) along each axis.
using Voxel = std::array<std::int32_t, 3>;
Voxel voxel_at(const Eigen::Vector3d& point, double side);
Eigen::Vector3d centre_of(const Voxel& voxel, double side);
Eigen::AlignedBox3d box_of(const Voxel& voxel, double side);

/// Which voxels the cameras saw surface in: those in which the exact point of a pixel lies, to a millimetre.
class SeenSurface {
 public:
  /// @param side      of a voxel of the map, m
  /// @param farthest  depth Z up to which surface counts as seen, m
  SeenSurface(double side, double farthest) : side_(side), farthest_(farthest) {}

  /// @param exact_depth   CV_32FC1 at the pixel centres, metres along the optical axis, NaN = none
  /// @param camera        pinhole of the image (its distortion is ignored)
  /// @param T_map_camera  of the true camera, in the frame of the map
  void add(const cv::Mat& exact_depth, const Camera& camera, const Pose& T_map_camera);
  /// The seen voxels that a triangle of the surface passes through, in rising order.
  [[nodiscard]] std::vector<Voxel> voxels(const PlacedSurface& surface) const;

 private:
  double side_;
  double farthest_;
  std::vector<Voxel> voxels_;  // rising
};

/// What the map says of voxels that hold surface.
struct SurfaceShares {
  std::size_t voxels = 0;
  std::size_t occupied = 0, free = 0, unknown = 0;  ///< add up to `voxels`
  std::size_t occupied_or_neighbour = 0;            ///< it or one of its 26 neighbours is occupied
};
/// @param voxels  that hold the surface. Where it lies on a face, no point of it more than a millimetre
/// inside of the
///                voxel, either voxel of the face may hold it: together they are occupied if one is, and
///                free if both are. (Else rounding would decide about a floor at z = 0.)
SurfaceShares surface_shares(const mapping::OccupancyMap& map, const std::vector<Voxel>& voxels,
                             const PlacedSurface& surface);

/// Occupied voxels no part of which is near any surface, seen or not.
struct Phantoms {
  static constexpr std::array<double, 3> distances = {0.15, 0.3, 0.5};  ///< metres
  std::size_t occupied = 0;
  std::array<std::size_t, distances.size()> farther{};  ///< of them farther than each distance
};
Phantoms phantoms(const mapping::OccupancyMap& map, const PlacedSurface& surface);

/// The surface that the camera sees about the direction of flight, and what the map has there. Counts of
/// pixels.
struct AheadShares {
  std::size_t frames = 0;  ///< that saw any
  std::size_t points = 0;
  std::size_t occupied_near = 0;                    ///< the centre of an occupied voxel is within 15 cm
  std::size_t occupied = 0, free = 0, unknown = 0;  ///< the voxel that holds the point; add up to `points`
  AheadShares& operator+=(const AheadShares& other);
};
struct AheadOptions {
  double angle = 6 * 3.14159265358979323846 / 180;  ///< about the direction of flight, rad
  double farthest = 12;                             ///< depth Z, m
  double near = 0.15;                               ///< from the point to the centre of an occupied voxel, m
};
/// @param direction  of flight, in camera coordinates, any length but 0
AheadShares ahead_shares(const mapping::OccupancyMap& map, const cv::Mat& exact_depth, const Camera& camera,
                         const Pose& T_map_camera, const Eigen::Vector3d& direction,
                         const AheadOptions& options = {});

}  // namespace pade::evaluation
