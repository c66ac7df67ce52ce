#include "pade/evaluation/map/view_ahead.hpp"

#include <algorithm>
#include <cmath>

#include "pade/evaluation/map/rigid_alignment.hpp"

namespace pade::evaluation {
namespace {

using mapping::Occupancy;
using mapping::OccupancyMap;

/// By nearest rank.
double percentile(std::vector<double> values, double share) {
  if (values.empty()) return 0;
  std::sort(values.begin(), values.end());
  const auto rank = static_cast<std::size_t>(std::ceil(share * static_cast<double>(values.size())));
  return values[std::clamp<std::size_t>(rank, 1, values.size()) - 1];
}

/// Calls visit(voxel) for all voxels whose box meets the box, in rising order, until it returns false.
template <class Visit>
bool each_voxel(const Eigen::AlignedBox3d& box, double side, const Visit& visit) {
  const Voxel low = voxel_at(box.min(), side);
  const Voxel high = voxel_at(box.max(), side);
  for (int x = low[0]; x <= high[0]; ++x) {
    for (int y = low[1]; y <= high[1]; ++y) {
      for (int z = low[2]; z <= high[2]; ++z) {
        if (!visit(Voxel{x, y, z})) return false;
      }
    }
  }
  return true;
}

/// Up to where a line is clear of the surface by a millimetre, at most `farthest`: by steps of the distance.
double clear_way(const PlacedSurface& surface, const Eigen::Vector3d& from, const Eigen::Vector3d& along,
                 double farthest) {
  constexpr double kTouch = 1e-3;  // metres
  double s = 0;
  while (s < farthest) {
    const double free = surface.distance(from + s * along, farthest);
    if (free < kTouch) return s;
    s += free;
  }
  return farthest;
}

struct ShellCounts {
  std::size_t voxels = 0, truly_free = 0, known_free = 0, called_occupied = 0;
};

}  // namespace

/// The way ahead of one frame, in the frame of the map.
struct ViewAhead::Line {
  Eigen::Vector3d from;
  Eigen::Vector3d along;  // unit
  Pose T_world_map;
  PlacedSurface surface;
};

ViewAhead::ViewAhead(const TrueWorld& world, const ViewAheadOptions& options)
    : world_(world), options_(options) {
  const int farthest = static_cast<int>(options.farthest);
  for (int metre = 1; metre < farthest; ++metre) sums_.shells.push_back({metre, metre + 1});
}

void ViewAhead::add(const OccupancyMap& map, const Pose& T_map_camera, const Pose& T_world_camera,
                    const Eigen::Vector3d& direction, const cv::Mat& exact_depth, const Camera& camera) {
  ++sums_.frames;
  const Pose T_map_world = registration(T_map_camera, T_world_camera);
  const Line line{T_map_camera.translation, T_map_camera.rotation * direction.normalized(),
                  T_map_world.inverse(), PlacedSurface(world_.surface, T_map_world)};
  add_corridor(map, line);
  add_reach(map, line);
  if (!exact_depth.empty()) {
    sums_.surface += ahead_shares(map, exact_depth, camera, T_map_camera, direction, options_.surface);
  }
}

void ViewAhead::add_corridor(const OccupancyMap& map, const Line& line) {
  const double side = map.options().voxel;
  std::vector<ShellCounts> counts(sums_.shells.size() + 1);  // of metre i, i + 1
  Eigen::AlignedBox3d bounds(line.from);
  bounds.extend(Eigen::Vector3d(line.from + options_.farthest * line.along));
  const Eigen::Vector3d margin = Eigen::Vector3d::Constant(options_.corridor_radius + side);
  each_voxel({bounds.min() - margin, bounds.max() + margin}, side, [&](const Voxel& voxel) {
    const Eigen::Vector3d centre = centre_of(voxel, side);
    const Eigen::Vector3d offset = centre - line.from;
    const double ahead = offset.dot(line.along);
    if (!(ahead >= 0 && ahead < static_cast<double>(counts.size()))) return true;
    if ((offset - ahead * line.along).norm() > options_.corridor_radius) return true;
    ShellCounts& shell = counts[static_cast<std::size_t>(ahead)];
    ++shell.voxels;
    if (line.surface.overlaps(box_of(voxel, side))) return true;
    if (world_.inside_solid && world_.inside_solid(line.T_world_map * centre)) return true;
    ++shell.truly_free;
    const Occupancy state = map.at(centre);
    if (state == Occupancy::free) ++shell.known_free;
    if (state == Occupancy::occupied) ++shell.called_occupied;
    return true;
  });
  const double clear = clear_way(line.surface, line.from, line.along, options_.farthest);
  for (Shell& sum : sums_.shells) {
    const ShellCounts& shell = counts[static_cast<std::size_t>(sum.from)];
    const auto enough = options_.corridor_truly_free * static_cast<double>(shell.voxels);
    if (sum.to > clear || shell.truly_free == 0 || static_cast<double>(shell.truly_free) < enough) continue;
    ++sum.frames;
    sum.known_free += static_cast<double>(shell.known_free) / static_cast<double>(shell.truly_free);
    sum.called_occupied += static_cast<double>(shell.called_occupied) / static_cast<double>(shell.truly_free);
  }
}

void ViewAhead::add_reach(const OccupancyMap& map, const Line& line) {
  const double side = map.options().voxel;
  const double radius = options_.sphere_radius;
  const double step = 0.5 * side;
  double known = 0;
  double truly = 0;
  bool map_lets = true;
  bool truth_lets = true;
  for (double s = options_.sphere_start; s <= options_.farthest + 1e-9 && (map_lets || truth_lets);
       s += step) {
    const Eigen::Vector3d centre = line.from + s * line.along;
    const Eigen::Vector3d reach = Eigen::Vector3d::Constant(radius);
    map_lets =
        map_lets && each_voxel({centre - reach, centre + reach}, side, [&](const Voxel& voxel) {
          if (box_of(voxel, side).squaredExteriorDistance(centre) > radius * radius) return true;
          const Eigen::Vector3d middle = centre_of(voxel, side);
          return (middle - line.from).norm() < options_.sphere_start || map.at(middle) == Occupancy::free;
        });
    truth_lets = truth_lets && !(line.surface.distance(centre, radius) <= radius);
    if (map_lets) known = s;
    if (truth_lets) truly = s;
  }
  if (known > truly) ++sums_.reach.past_surface;
  reaches_.push_back(std::min(known, truly));
  true_reaches_.push_back(truly);
}

ViewAheadResult ViewAhead::result() const {
  ViewAheadResult result = sums_;
  for (Shell& shell : result.shells) {
    if (shell.frames == 0) continue;
    shell.known_free /= static_cast<double>(shell.frames);
    shell.called_occupied /= static_cast<double>(shell.frames);
  }
  result.reach.frames = reaches_.size();
  result.reach.p10 = percentile(reaches_, 0.1);
  result.reach.median = percentile(reaches_, 0.5);
  result.reach.true_p10 = percentile(true_reaches_, 0.1);
  result.reach.true_median = percentile(true_reaches_, 0.5);
  return result;
}

}  // namespace pade::evaluation
