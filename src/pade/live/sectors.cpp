#include "pade/live/sectors.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "pade/core/option_check.hpp"
#include "pade/live/reach.hpp"
#include "pade/mapping/query/tile_tree.hpp"
#include "pade/mapping/query/voxel_grid.hpp"

namespace pade::live {
namespace {

using Eigen::Vector3d;
using mapping::Tile;
using mapping::VoxelIndex;

constexpr double kDegrees = 180 / std::numbers::pi;
constexpr int kCount = static_cast<int>(kBins);

/// Bins in which something lies that covers a range of bearings.
struct BinRange {
  int first = 0;
  int last = kCount - 1;

  /// @param low, high  bearings, degrees, at most half a turn apart
  static BinRange of(double low, double high) {
    const int first = static_cast<int>(std::floor((low - 2 * kBinAngle) / kBinAngle)) + 1;
    const int last = static_cast<int>(std::floor((high + kBinAngle) / kBinAngle));
    return {first, std::min(last, first + kCount - 1)};
  }
  template <class Visit>
  void for_each(const Visit& visit) const {
    for (int k = first; k <= last; ++k) visit(static_cast<std::size_t>((k % kCount + kCount) % kCount));
  }
};

/// What is known so far, bin by bin.
class Bins {
 public:
  Bins(const Pose& T_world_body, double voxel, const SectorOptions& options, const SectorView& sight)
      : place_(T_world_body.translation), voxel_(voxel), options_(options), sight_(sight) {
    const Vector3d forward = T_world_body.rotation * Vector3d::UnitX();
    heading_ = std::atan2(forward.y(), forward.x());
    nearest_.fill(std::numeric_limits<double>::infinity());
    for (std::size_t k = 0; k < kBins; ++k) {
      const double low = kBinAngle * static_cast<double>(k) - kBinAngle;
      seen_[k] =
          sight.half >= 180 || (in_sight(low) && in_sight(low + kBinAngle) && in_sight(low + 3 * kBinAngle));
    }
  }

  /// Whether a square of voxels (lower corner, voxels to a side) can say anything new.
  [[nodiscard]] bool can_matter(const VoxelIndex& v, int side, bool occupied, bool unknown) const {
    const Square square(*this, v, side);
    if (square.distance > options_.max_distance) return false;
    bool matters = false;
    square.bins.for_each([&](std::size_t k) {
      matters =
          matters || (occupied && square.in_sight && square.distance < nearest_[k]) || (unknown && seen_[k]);
    });
    return matters;
  }
  void add(const VoxelIndex& v, bool occupied, bool unknown) {
    const Square square(*this, v, 1);
    if (square.distance > options_.max_distance) return;
    const bool hides = unknown && square.distance >= options_.own_radius;
    square.bins.for_each([&](std::size_t k) {
      if (occupied && square.in_sight) nearest_[k] = std::min(nearest_[k], square.distance);
      if (hides) seen_[k] = false;
    });
  }
  [[nodiscard]] std::array<std::uint16_t, kBins> distances() const {
    const auto centimetres = [](double metres) { return static_cast<std::uint16_t>(100 * metres); };
    std::array<std::uint16_t, kBins> result{};
    for (std::size_t k = 0; k < kBins; ++k) {
      const auto free = static_cast<std::uint16_t>(centimetres(options_.max_distance) + 1);
      const bool obstacle = nearest_[k] <= options_.max_distance;
      result[k] = seen_[k] ? free : kUnknownDistance;
      if (obstacle) result[k] = centimetres(std::max(nearest_[k], options_.min_distance));
    }
    return result;
  }

 private:
  /// Seen from above and from the body: nearest point and bins.
  struct Square {
    Square(const Bins& from, const VoxelIndex& v, int side) {
      const double x0 = (v[0] - mapping::kTreeCentre) * from.voxel_ - from.place_.x();
      const double y0 = (v[1] - mapping::kTreeCentre) * from.voxel_ - from.place_.y();
      const double x1 = x0 + side * from.voxel_;
      const double y1 = y0 + side * from.voxel_;
      distance = std::hypot(std::clamp(0.0, x0, x1), std::clamp(0.0, y0, y1));
      if (distance == 0) return;  // all around
      const double middle = std::atan2((y0 + y1) / 2, (x0 + x1) / 2);
      double left = 0, right = 0;  // of the middle, rad
      for (const auto& [x, y] : {std::pair{x0, y0}, {x0, y1}, {x1, y0}, {x1, y1}}) {
        const double angle = std::remainder(std::atan2(y, x) - middle, 2 * std::numbers::pi);
        left = std::max(left, angle);
        right = std::min(right, angle);
      }
      const double bearing = std::remainder(from.heading_ - middle, 2 * std::numbers::pi);
      const double low = kDegrees * (bearing - left);
      const double high = kDegrees * (bearing - right);
      bins = BinRange::of(low, high);
      in_sight = from.touches_sight(low, high);
    }
    double distance = 0;
    bool in_sight = true;  ///< or at its edge
    BinRange bins;
  };

  [[nodiscard]] bool in_sight(double bearing) const {
    return std::abs(std::remainder(bearing - sight_.middle, 360)) <= sight_.half;
  }
  /// Anything between two bearings, high - low < 180.
  [[nodiscard]] bool touches_sight(double low, double high) const {
    if (sight_.half >= 180) return true;
    const double middle = std::remainder((low + high) / 2 - sight_.middle, 360);
    return std::abs(middle) <= sight_.half + (high - low) / 2;
  }

  Vector3d place_;
  double heading_ = 0;  // from east towards north, rad
  double voxel_;
  SectorOptions options_;
  SectorView sight_;
  std::array<double, kBins> nearest_{};
  std::array<bool, kBins> seen_{};
};

/// Voxels of a column of tiles from above: bit 8 y + x.
struct Shadow {
  std::uint64_t occupied = 0;
  std::uint64_t unknown = 0;

  void add(const Tile& tile, int first, int last) {
    for (int z = first; z <= last; ++z) {
      const Tile::Word& word = tile.words[static_cast<std::size_t>(z)];
      occupied |= word.occupied;
      unknown |= ~word.known;
    }
  }
};

struct Column {
  int ring, x, y;
};

/// The columns of tiles between two voxels, the middle ones first.
std::vector<Column> columns_between(const VoxelIndex& low, const VoxelIndex& high) {
  const int cx = (low[0] + high[0]) / 2 >> 3;
  const int cy = (low[1] + high[1]) / 2 >> 3;
  std::vector<Column> columns;
  for (int y = low[1] >> 3; y <= high[1] >> 3; ++y) {
    for (int x = low[0] >> 3; x <= high[0] >> 3; ++x) {
      columns.push_back({std::max(std::abs(x - cx), std::abs(y - cy)), x, y});
    }
  }
  std::stable_sort(columns.begin(), columns.end(),
                   [](const Column& a, const Column& b) { return a.ring < b.ring; });
  return columns;
}

}  // namespace

Status check(const SectorOptions& options) {
  constexpr double kFarthest = 100;  // m
  const OptionRange ranges[] = {
      {"sectors.min_distance", options.min_distance, 0.01, kFarthest},
      {"sectors.max_distance", options.max_distance, options.min_distance + 0.01, kFarthest},
      {"sectors.below", options.below, 0, 100},
      {"sectors.above", options.above, 0, 100},
      // Nobody has seen what lies within: it must not be all that counts.
      {"sectors.own_radius", options.own_radius, 0, std::min(3.0, options.max_distance / 2)},
  };
  return check_ranges(ranges);
}

SectorView SectorView::of(const Camera& camera, const Pose& T_body_camera) {
  constexpr double kLevel = 0.2;  // least share of a direction that is horizontal
  const auto bearing = [&](double x, bool& is_level) {
    const Vector3d ray(  // of the middle row
        (x - camera.cx) / camera.fx, 0, 1);
    const Vector3d d = (T_body_camera.rotation * ray).normalized();
    is_level = is_level && std::hypot(d.x(), d.y()) > kLevel;
    return kDegrees * std::atan2(-d.y(), d.x());
  };
  bool is_level = true;
  const double middle = bearing(camera.cx, is_level);
  const double left = bearing(-0.5, is_level);
  const double right = bearing(camera.width - 0.5, is_level);
  if (!is_level) return {0, 0};
  return {middle, std::min(std::abs(std::remainder(left - middle, 360)),
                           std::abs(std::remainder(right - middle, 360)))};
}

std::array<std::uint16_t, kBins> obstacle_distances(const mapping::MapView& view, const Pose& T_world_body,
                                                    const SectorOptions& options, const SectorView& sight) {
  const mapping::TileTree& tiles = view.tiles();
  Bins bins(T_world_body, tiles.voxel, options, sight);
  const auto reach = Reach::around(T_world_body.translation, options, tiles.voxel);
  if (!reach) {
    std::array<std::uint16_t, kBins> unknown{};
    unknown.fill(kUnknownDistance);
    return unknown;
  }
  const VoxelIndex &low = reach->low, &high = reach->high;
  static const Tile kBeyond;
  for (const Column& column : columns_between(low, high)) {
    const VoxelIndex corner{8 * column.x, 8 * column.y, 0};
    Shadow shadow;
    for (int z = low[2] >> 3; z <= high[2] >> 3; ++z) {
      const bool addressed = mapping::is_addressed({corner[0], corner[1], 8 * z});
      const Tile& tile = addressed ? tiles.tile(column.x, column.y, z) : kBeyond;
      if (!tile.any_occupied && !tile.any_unknown) continue;
      shadow.add(tile, std::max(low[2] - 8 * z, 0), std::min(high[2] - 8 * z, 7));
    }
    std::uint64_t bits = shadow.occupied | shadow.unknown;
    if (bits == 0 || !bins.can_matter(corner, 8, shadow.occupied != 0, shadow.unknown != 0)) continue;
    for (; bits != 0; bits &= bits - 1) {
      const int bit = std::countr_zero(bits);
      bins.add({corner[0] + (bit & 7), corner[1] + (bit >> 3), 0}, (shadow.occupied >> bit & 1U) != 0,
               (shadow.unknown >> bit & 1U) != 0);
    }
  }
  return bins.distances();
}

mavlink::ObstacleDistance obstacle_distance_message(const std::array<std::uint16_t, kBins>& distances,
                                                    Time time, const SectorOptions& options) {
  constexpr std::uint8_t kUnknownSensor = 4;
  constexpr std::uint8_t kBodyFrame = 12;  // MAV_FRAME_BODY_FRD
  mavlink::ObstacleDistance message;
  message.time_usec = static_cast<std::uint64_t>(time.nanoseconds / 1000);
  message.sensor_type = kUnknownSensor;
  message.distances = distances;
  message.increment = static_cast<std::uint8_t>(kBinAngle);
  message.min_distance = static_cast<std::uint16_t>(100 * options.min_distance);
  message.max_distance = static_cast<std::uint16_t>(100 * options.max_distance);
  message.frame = kBodyFrame;
  return message;
}

}  // namespace pade::live
