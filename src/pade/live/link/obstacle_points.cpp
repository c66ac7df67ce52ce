#include "pade/live/link/obstacle_points.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <numbers>

#include "pade/live/reach.hpp"
#include "pade/mapping/query/tile_tree.hpp"
#include "pade/mapping/query/voxel_grid.hpp"

namespace pade::live {
namespace {

using Eigen::AlignedBox3d;
using Eigen::Vector3d;
using mapping::Tile;
using mapping::VoxelIndex;

constexpr double kRadians = std::numbers::pi / 180;
// Cells of directions; the borders of ArduPilot's faces are borders of theirs.
constexpr int kCellBearings = 80;    // of 4.5°
constexpr int kCellElevations = 36;  // of 5°

/// To the left and up, as the body's frame has them, rad.
struct Direction {
  double bearing = 0;
  double elevation = 0;

  static Direction of(const Vector3d& v) {
    return {std::atan2(v.y(), v.x()), std::atan2(v.z(), std::hypot(v.x(), v.y()))};
  }
  [[nodiscard]] Vector3d ray() const {
    return {std::cos(elevation) * std::cos(bearing), std::cos(elevation) * std::sin(bearing),
            std::sin(elevation)};
  }
};

/// The nearest obstacle of each cell of directions.
class Cells {
 public:
  Cells() { nearest_.fill(std::numeric_limits<double>::infinity()); }

  /// What is so near and lies between these directions, bearings at most half a turn apart.
  void add(const Direction& low, const Direction& high, double distance) {
    const int first = column_of(low.bearing);
    const int last = column_of(high.bearing);
    for (int j = row_of(low.elevation); j <= row_of(high.elevation); ++j) {
      if (j < 0 || j >= kCellElevations) continue;
      for (int i = first; i <= last; ++i) {
        const int column = ((i % kCellBearings) + kCellBearings) % kCellBearings;
        const auto slot = static_cast<std::size_t>(j * kCellBearings + column);
        if (distance >= nearest_[slot]) continue;
        nearest_[slot] = distance;
        where_[slot] = {std::clamp(bearing_of(i), low.bearing, high.bearing),
                        std::clamp(elevation_of(j), low.elevation, high.elevation)};
      }
    }
  }
  [[nodiscard]] std::vector<Vector3d> points() const {
    std::vector<Vector3d> found;
    for (std::size_t slot = 0; slot < nearest_.size(); ++slot) {
      if (std::isfinite(nearest_[slot])) found.emplace_back(nearest_[slot] * where_[slot].ray());
    }
    return found;
  }

 private:
  static int column_of(double bearing) {
    return static_cast<int>(std::floor(bearing / (2 * std::numbers::pi) * kCellBearings)) + kCellBearings / 2;
  }
  static int row_of(double elevation) {
    return static_cast<int>(std::floor(elevation / std::numbers::pi * kCellElevations)) + kCellElevations / 2;
  }
  /// Of the middle of column i, rad.
  static double bearing_of(int i) { return 2 * std::numbers::pi * ((i + 0.5) / kCellBearings - 0.5); }
  static double elevation_of(int j) { return std::numbers::pi * ((j + 0.5) / kCellElevations - 0.5); }

  std::array<double, static_cast<std::size_t>(kCellBearings* kCellElevations)> nearest_{};
  std::array<Direction, static_cast<std::size_t>(kCellBearings* kCellElevations)> where_{};
};

/// One voxel after the other, of those that may matter.
class Finder {
 public:
  Finder(const Pose& T_world_body, const SectorOptions& options, const Camera& camera,
         const Pose& T_body_camera)
      : T_body_world_(T_world_body.inverse()),
        place_(T_world_body.translation),
        T_camera_body_(T_body_camera.inverse()),
        options_(options),
        camera_(camera) {}

  [[nodiscard]] bool is_near(const AlignedBox3d& box) const {
    return box.exteriorDistance(place_) <= options_.max_distance;
  }
  void add(const AlignedBox3d& box) {
    const double distance = box.exteriorDistance(place_);
    if (distance > options_.max_distance || distance <= 0) return;
    std::array<Vector3d, 8> corners;
    bool seen = is_seen(T_body_world_ * box.center());
    for (std::size_t i = 0; i < corners.size(); ++i) {
      corners[i] = T_body_world_ * box.corner(static_cast<AlignedBox3d::CornerType>(i));
      seen = seen || is_seen(corners[i]);
    }
    if (!seen) return;
    const Direction middle = Direction::of(T_body_world_ * box.center());
    Direction low = middle, high = middle;
    for (const Vector3d& corner : corners) {
      const Direction d = Direction::of(corner);
      const double aside = std::remainder(d.bearing - middle.bearing, 2 * std::numbers::pi);
      low = {std::min(low.bearing, middle.bearing + aside), std::min(low.elevation, d.elevation)};
      high = {std::max(high.bearing, middle.bearing + aside), std::max(high.elevation, d.elevation)};
    }
    cells_.add(low, high, std::max(distance, options_.min_distance));
  }
  [[nodiscard]] std::vector<Vector3d> points() const { return cells_.points(); }

 private:
  [[nodiscard]] bool is_seen(const Vector3d& point_in_body) const {
    const Vector3d p = T_camera_body_ * point_in_body;
    if (!(p.z() > 0)) return false;
    const double u = camera_.fx * p.x() / p.z() + camera_.cx;
    const double v = camera_.fy * p.y() / p.z() + camera_.cy;
    return u >= -0.5 && u <= camera_.width - 0.5 && v >= -0.5 && v <= camera_.height - 0.5;
  }

  Pose T_body_world_;
  Vector3d place_;
  Pose T_camera_body_;
  SectorOptions options_;
  Camera camera_;
  Cells cells_;
};

template <class Visit>
void for_each_occupied(const Tile& tile, int first, int last, const Visit& visit) {
  for (int z = first; z <= last; ++z) {
    for (std::uint64_t bits = tile.words[static_cast<std::size_t>(z)].occupied; bits != 0; bits &= bits - 1) {
      const int bit = std::countr_zero(bits);
      visit(bit & 7, bit >> 3, z);
    }
  }
}

/// Faces of ArduPilot's boundary.
std::size_t face_of(const Direction& d) {
  const double bearing = -d.bearing / kRadians;  // clockwise, degrees
  const int sector = static_cast<int>(std::floor((bearing + 22.5) / 45));
  const int layer = std::clamp(static_cast<int>(std::floor((d.elevation / kRadians + 75) / 30)), 0, 4);
  return static_cast<std::size_t>(8 * layer + ((sector % 8) + 8) % 8);
}

mavlink::ObstacleDistance3d message_of(const Vector3d& point, std::uint32_t time_boot_ms,
                                       const SectorOptions& options) {
  constexpr std::uint8_t kUnknownSensor = 4;  // MAV_DISTANCE_SENSOR_UNKNOWN
  constexpr std::uint8_t kBodyFrame = 12;     // MAV_FRAME_BODY_FRD
  constexpr std::uint16_t kNoNumber = 65535;  // of the obstacle
  mavlink::ObstacleDistance3d message;
  message.time_boot_ms = time_boot_ms;
  message.sensor_type = kUnknownSensor;
  message.frame = kBodyFrame;
  message.obstacle_id = kNoNumber;
  message.x = static_cast<float>(point.x());
  message.y = static_cast<float>(-point.y());
  message.z = static_cast<float>(-point.z());
  // What lies on the limit counts.
  message.min_distance = static_cast<float>(0.999 * options.min_distance);
  message.max_distance = static_cast<float>(1.001 * options.max_distance);
  return message;
}

}  // namespace

std::optional<std::vector<Vector3d>> obstacle_points(const mapping::MapView& view, const Pose& T_world_body,
                                                     const SectorOptions& options, const Camera& camera,
                                                     const Pose& T_body_camera) {
  const mapping::TileTree& tiles = view.tiles();
  const auto reach = Reach::around(T_world_body.translation, options, tiles.voxel);
  if (!reach || !reach->addressed) return std::nullopt;
  const VoxelIndex &low = reach->low, &high = reach->high;
  VoxelIndex first{}, last{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    first[axis] = std::max(low[axis] >> 3, tiles.bounds.first[axis]);
    last[axis] = std::min(high[axis] >> 3, tiles.bounds.last[axis]);
  }
  Finder finder(T_world_body, options, camera, T_body_camera);
  for (int z = first[2]; z <= last[2]; ++z) {
    for (int y = first[1]; y <= last[1]; ++y) {
      for (int x = first[0]; x <= last[0]; ++x) {
        const Tile& tile = tiles.tile(x, y, z);
        const AlignedBox3d box(mapping::corner_of({8 * x, 8 * y, 8 * z}, tiles.voxel),
                               mapping::corner_of({8 * x + 8, 8 * y + 8, 8 * z + 8}, tiles.voxel));
        if (!tile.any_occupied || !finder.is_near(box)) continue;
        for_each_occupied(tile, std::max(low[2] - 8 * z, 0), std::min(high[2] - 8 * z, 7),
                          [&](int i, int j, int k) {
                            finder.add(mapping::box_of({8 * x + i, 8 * y + j, 8 * z + k}, tiles.voxel));
                          });
      }
    }
  }
  return finder.points();
}

std::vector<mavlink::ObstacleDistance3d> obstacle_messages(std::span<const Vector3d> points,
                                                           std::uint32_t time_boot_ms,
                                                           const SectorOptions& options) {
  std::array<const Vector3d*, 40> nearest{};
  for (const Vector3d& point : points) {
    if (point.norm() > options.max_distance || point.isZero(1e-6)) continue;
    const Vector3d*& known = nearest[face_of(Direction::of(point))];
    if (known == nullptr || point.squaredNorm() < known->squaredNorm()) known = &point;
  }
  std::vector<Vector3d> sent;
  for (const Vector3d* point : nearest) {
    if (point != nullptr) sent.emplace_back(std::max(1.0, options.min_distance / point->norm()) * *point);
  }
  if (sent.empty()) sent.emplace_back(options.max_distance + 1, 0, 0);
  std::vector<mavlink::ObstacleDistance3d> messages;
  for (const std::uint32_t stamp : {time_boot_ms, time_boot_ms + 1}) {
    for (const Vector3d& point : sent) messages.push_back(message_of(point, stamp, options));
  }
  return messages;
}

}  // namespace pade::live
