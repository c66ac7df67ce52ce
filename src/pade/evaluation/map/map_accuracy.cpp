#include "pade/evaluation/map/map_accuracy.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

namespace pade::evaluation {
namespace {

using mapping::Occupancy;
using mapping::OccupancyMap;

/// Nearer to a face of a voxel than this, rounding and the chords of round shapes say which side a point is
/// on.
constexpr double kOnFace = 1e-3;  // metres

void sort_unique(std::vector<Voxel>& voxels) {
  std::sort(voxels.begin(), voxels.end());
  voxels.erase(std::unique(voxels.begin(), voxels.end()), voxels.end());
}

/// Points along the rays of a pinhole image, in the frame of the map.
class PixelPoints {
 public:
  PixelPoints(const Camera& camera, const Pose& T_map_camera)
      : camera_(camera), R_(T_map_camera.matrix3()), t_(T_map_camera.translation) {}
  [[nodiscard]] Eigen::Vector3d ray(int u, int v) const {  // camera coordinates, Z = 1
    return {(u - camera_.cx) / camera_.fx, (v - camera_.cy) / camera_.fy, 1};
  }
  [[nodiscard]] Eigen::Vector3d point(const Eigen::Vector3d& ray, double depth) const {
    return R_ * (depth * ray) + t_;
  }

 private:
  const Camera& camera_;
  Eigen::Matrix3d R_;
  Eigen::Vector3d t_;
};

bool any_neighbour_occupied(const OccupancyMap& map, const Voxel& voxel, double side) {
  for (int i = 0; i < 27; ++i) {
    const Voxel neighbour = {voxel[0] + i % 3 - 1, voxel[1] + i / 3 % 3 - 1, voxel[2] + i / 9 - 1};
    if (map.at(centre_of(neighbour, side)) == Occupancy::occupied) return true;
  }
  return false;
}

/// The state of a voxel that holds surface, with that of the neighbours on whose face the surface lies.
Occupancy state_of(const OccupancyMap& map, const Voxel& voxel, const PlacedSurface& surface) {
  const double side = map.options().voxel;
  const Eigen::AlignedBox3d box = box_of(voxel, side);
  const Eigen::Vector3d margin = Eigen::Vector3d::Constant(kOnFace);
  Occupancy state = map.at(centre_of(voxel, side));
  if (surface.overlaps({box.min() + margin, box.max() - margin})) return state;
  for (std::size_t face = 0; face < 6 && state != Occupancy::occupied; ++face) {
    const auto axis = static_cast<Eigen::Index>(face / 2);
    const bool above = face % 2 != 0;
    Eigen::AlignedBox3d plate = box;
    (above ? plate.min() : plate.max())[axis] = (above ? box.max() : box.min())[axis];
    plate.min()[axis] -= kOnFace;
    plate.max()[axis] += kOnFace;
    if (!surface.overlaps(plate)) continue;
    Voxel neighbour = voxel;
    neighbour[face / 2] += above ? 1 : -1;
    const Occupancy other = map.at(centre_of(neighbour, side));
    if (other != state) state = other == Occupancy::occupied ? other : Occupancy::unknown;
  }
  return state;
}

/// Is the centre of an occupied voxel within `near` of the point?
bool occupied_within(const OccupancyMap& map, const Eigen::Vector3d& point, double near) {
  const double side = map.options().voxel;
  const Voxel low = voxel_at(point - Eigen::Vector3d::Constant(near + 0.5 * side), side);
  const Voxel high = voxel_at(point + Eigen::Vector3d::Constant(near + 0.5 * side), side);
  for (int x = low[0]; x <= high[0]; ++x) {
    for (int y = low[1]; y <= high[1]; ++y) {
      for (int z = low[2]; z <= high[2]; ++z) {
        const Eigen::Vector3d centre = centre_of({x, y, z}, side);
        if ((centre - point).squaredNorm() <= near * near && map.at(centre) == Occupancy::occupied)
          return true;
      }
    }
  }
  return false;
}

}  // namespace

// With 1 / side as OctoMap has it: a wall at 0.3 m lies in voxel 3 of 0.1 m, where 3 * 0.1 would be above it.
Voxel voxel_at(const Eigen::Vector3d& point, double side) {
  const double per_voxel = 1 / side;
  Voxel voxel{};
  for (int axis = 0; axis < 3; ++axis) {
    voxel[static_cast<std::size_t>(axis)] = static_cast<std::int32_t>(std::floor(per_voxel * point[axis]));
  }
  return voxel;
}

Eigen::Vector3d centre_of(const Voxel& voxel, double side) {
  return side * Eigen::Vector3d(voxel[0] + 0.5, voxel[1] + 0.5, voxel[2] + 0.5);
}

Eigen::AlignedBox3d box_of(const Voxel& voxel, double side) {
  const double per_voxel = 1 / side;
  const Eigen::Vector3d corner(voxel[0], voxel[1], voxel[2]);
  return {corner / per_voxel, (corner + Eigen::Vector3d::Ones()) / per_voxel};
}

void SeenSurface::add(const cv::Mat& exact_depth, const Camera& camera, const Pose& T_map_camera) {
  const PixelPoints pixels(camera, T_map_camera);
  const Eigen::Vector3d rounding = Eigen::Vector3d::Constant(kOnFace);
  std::vector<Voxel> seen;
  const auto add = [&](const Voxel& voxel) {
    if (seen.empty() || seen.back() != voxel) seen.push_back(voxel);
  };
  for (int v = 0; v < exact_depth.rows; ++v) {
    const auto* depth = exact_depth.ptr<float>(v);
    for (int u = 0; u < exact_depth.cols; ++u) {
      if (!(depth[u] > 0 && depth[u] <= farthest_)) continue;
      const Eigen::Vector3d point = pixels.point(pixels.ray(u, v), depth[u]);
      const Voxel low = voxel_at(point - rounding, side_);
      const Voxel high = voxel_at(point + rounding, side_);
      add(low);
      if (low == high) continue;
      for (int i = 1; i < 8; ++i) {
        add({i % 2 != 0 ? high[0] : low[0], i / 2 % 2 != 0 ? high[1] : low[1],
             i / 4 != 0 ? high[2] : low[2]});
      }
    }
  }
  sort_unique(seen);
  std::vector<Voxel> both;
  both.reserve(voxels_.size() + seen.size());
  std::set_union(voxels_.begin(), voxels_.end(), seen.begin(), seen.end(), std::back_inserter(both));
  voxels_ = std::move(both);
}

std::vector<Voxel> SeenSurface::voxels(const PlacedSurface& surface) const {
  std::vector<Voxel> voxels = voxels_;
  std::erase_if(voxels, [&](const Voxel& voxel) { return !surface.overlaps(box_of(voxel, side_)); });
  return voxels;
}

SurfaceShares surface_shares(const OccupancyMap& map, const std::vector<Voxel>& voxels,
                             const PlacedSurface& surface) {
  const double side = map.options().voxel;
  SurfaceShares shares;
  shares.voxels = voxels.size();
  for (const Voxel& voxel : voxels) {
    const Occupancy state = state_of(map, voxel, surface);
    if (state == Occupancy::occupied) ++shares.occupied;
    if (state == Occupancy::free) ++shares.free;
    if (state == Occupancy::unknown) ++shares.unknown;
    if (state == Occupancy::occupied || any_neighbour_occupied(map, voxel, side))
      ++shares.occupied_or_neighbour;
  }
  return shares;
}

Phantoms phantoms(const OccupancyMap& map, const PlacedSurface& surface) {
  const double side = map.options().voxel;
  const double farthest = Phantoms::distances.back();
  Phantoms result;
  const auto count = [&](const Eigen::AlignedBox3d& box) {
    ++result.occupied;
    const double distance = surface.distance(box, farthest);
    for (std::size_t i = 0; i < Phantoms::distances.size(); ++i) {
      if (distance > Phantoms::distances[i]) ++result.farther[i];
    }
  };
  for (const mapping::MapCell& cell : map.occupied()) {
    const int n = 1 << (mapping::kTreeDepth - cell.depth);
    const Eigen::Vector3d inside =
        cell.centre.cast<double>() - Eigen::Vector3d::Constant(0.5 * (n - 1) * side);  // of the first voxel
    const Voxel first = voxel_at(inside, side);
    for (int x = 0; x < n; ++x) {
      for (int y = 0; y < n; ++y) {
        for (int z = 0; z < n; ++z) count(box_of({first[0] + x, first[1] + y, first[2] + z}, side));
      }
    }
  }
  return result;
}

AheadShares& AheadShares::operator+=(const AheadShares& other) {
  frames += other.frames;
  points += other.points;
  occupied_near += other.occupied_near;
  occupied += other.occupied;
  free += other.free;
  unknown += other.unknown;
  return *this;
}

AheadShares ahead_shares(const OccupancyMap& map, const cv::Mat& exact_depth, const Camera& camera,
                         const Pose& T_map_camera, const Eigen::Vector3d& direction,
                         const AheadOptions& options) {
  const PixelPoints pixels(camera, T_map_camera);
  const Eigen::Vector3d unit = direction.normalized();
  const double cosine = std::cos(options.angle);
  AheadShares shares;
  for (int v = 0; v < exact_depth.rows; ++v) {
    const auto* depth = exact_depth.ptr<float>(v);
    for (int u = 0; u < exact_depth.cols; ++u) {
      if (!(depth[u] > 0 && depth[u] <= options.farthest)) continue;
      const Eigen::Vector3d ray = pixels.ray(u, v);
      if (ray.dot(unit) < cosine * ray.norm()) continue;
      const Eigen::Vector3d point = pixels.point(ray, depth[u]);
      ++shares.points;
      const Occupancy state = map.at(point);
      if (state == Occupancy::occupied) ++shares.occupied;
      if (state == Occupancy::free) ++shares.free;
      if (state == Occupancy::unknown) ++shares.unknown;
      if (occupied_within(map, point, options.near)) ++shares.occupied_near;
    }
  }
  if (shares.points > 0) shares.frames = 1;
  return shares;
}

}  // namespace pade::evaluation
