#include "pade/mapping/occupancy_map.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <string>
#include <utility>

#include <octomap/OcTree.h>

#include "pade/mapping/back_projection.hpp"
#include "pade/mapping/clearance.hpp"
#include "pade/mapping/hit_finder.hpp"
#include "pade/mapping/pending_hits.hpp"
#include "pade/mapping/tiles/free_ages.hpp"
#include "pade/mapping/tiles/free_search.hpp"
#include "pade/mapping/tiles/octree.hpp"
#include "pade/mapping/tiles/voxel_store.hpp"

namespace pade::mapping {

struct OccupancyMap::Scratch {
  explicit Scratch(const MapOptions& options) : finder(options) {
    if (options.forget_after > 0) ages.emplace(options.forget_after);
  }
  HitFinder finder;
  std::vector<std::uint64_t> occupied;  // all voxels that were hit, whether or not they are believed
  std::vector<VoxelHit> hits;
  std::vector<FreeCube> free, scratch;
  Clearance now;
  std::vector<const Clearance*> witnesses;
  // From image to image:
  std::vector<Clearance> views;  // the last few from places at least the baseline apart
  std::size_t oldest = 0;        // of `views`
  PendingHits pending;
  std::optional<FreeAges> ages;
  int view = 0;                       // places at least the baseline apart, so far
  Eigen::Vector3d place;              // of the last of them
  std::optional<VoxelKey> packed_at;  // the camera's voxel when what is far was packed last
  bool is_new_place = false;          // this image is from the next one
};

namespace {

constexpr std::size_t kViews = 4;
constexpr int kViewsUntilForgotten = 20;
constexpr double kRounding = 1e-6;    // of a baseline, m
constexpr float kPointsOfAPeak = 20;  // fewer, of all looks, do not tell a peak from chance

Error out_of_range(const char* option, double value, const std::string& expected) {
  return Error{"option " + std::string(option) + " is " + std::to_string(value) + ", expected " + expected};
}

/// Whether the looks together know the place of the surface to a voxel and a half. A look of sigma s
/// (voxels), spread by it once more, leaves the share p = 1 / (sqrt(4 pi) s) in the voxel of the surface; n
/// of them know its place to s / sqrt(n).
bool is_placed(const PendingHits::Evidence& evidence) {
  constexpr double kPlacedTo = 1.5;  // voxels
  const double sum = evidence.weight;
  const int looks = evidence.last_view - evidence.first_view + 1;
  return 4 * std::numbers::pi * sum * sum / looks >= 1 / (kPlacedTo * kPlacedTo);
}

/// Whether it has pixels that look somewhere.
bool is_usable(const Camera& camera) {
  return camera.width > 0 && camera.height > 0 && camera.fx > 0 && camera.fy > 0 &&
         std::isfinite(camera.fx + camera.fy + camera.cx + camera.cy);
}

/// Whether it is a rotation, to the rounding of files, and a place whose square is a number.
bool is_usable(const Pose& pose) {
  constexpr double kFarthest = 1e100;  // m
  return pose.is_finite() && std::abs(pose.rotation.squaredNorm() - 1) < 0.1 &&
         pose.translation.cwiseAbs().maxCoeff() < kFarthest;
}

/// By position, each place once: a cube holds what lies in it.
void put_in_order(std::vector<MapCell>& cells) {
  std::sort(cells.begin(), cells.end(), [](const MapCell& a, const MapCell& b) {
    const std::uint64_t code_a = morton_code(a.key);
    const std::uint64_t code_b = morton_code(b.key);
    return code_a != code_b ? code_a < code_b : a.depth < b.depth;
  });
  std::uint64_t end = 0;
  std::erase_if(cells, [&end](const MapCell& cell) {
    const std::uint64_t code = morton_code(cell.key);
    if (code < end) return true;
    end = code + voxels_of(cell.depth);
    return false;
  });
}

}  // namespace

Status check(const MapOptions& o) {
  const auto finite_positive = [](double value) { return value > 0 && std::isfinite(value); };
  if (!(o.voxel >= 0.001 && o.voxel <= 100)) return out_of_range("voxel", o.voxel, "0.001 to 100 m");
  if (!finite_positive(o.range)) return out_of_range("range", o.range, "a positive number of metres");
  if (!(o.p_hit > 0.5 && o.p_hit < 1)) return out_of_range("p_hit", o.p_hit, "above 0.5 and below 1");
  if (!(o.p_miss > 0 && o.p_miss < 0.5)) return out_of_range("p_miss", o.p_miss, "above 0 and below 0.5");
  if (!(o.clamp_max > 0 && o.clamp_max < 1)) {
    return out_of_range("clamp_max", o.clamp_max, "above 0 and below 1");
  }
  if (!(o.clamp_min > 0 && o.clamp_min < o.clamp_max)) {
    return out_of_range("clamp_min", o.clamp_min, "above 0 and below clamp_max");
  }
  if (!(o.occupancy_threshold > o.clamp_min && o.occupancy_threshold < o.clamp_max)) {
    return out_of_range("occupancy_threshold", o.occupancy_threshold, "between clamp_min and clamp_max");
  }
  if (!(o.free_margin_sigmas >= 0))
    return out_of_range("free_margin_sigmas", o.free_margin_sigmas, "at least 0");
  if (!(o.free_hole >= 0 && o.free_hole <= 1000)) return out_of_range("free_hole", o.free_hole, "0 to 1000");
  if (!(o.looks_baseline >= 0)) return out_of_range("looks_baseline", o.looks_baseline, "at least 0");
  if (!(o.forget_after == 0 || (o.forget_after >= 0.01 && o.forget_after <= 1e6)))
    return out_of_range("forget_after", o.forget_after, "0, or 0.01 to 1000000 s");
  if (!(o.pack_beyond == 0 || (o.pack_beyond >= 1 && o.pack_beyond <= 1e6)))
    return out_of_range("pack_beyond", o.pack_beyond, "0, or 1 to 1000000 m");
  if (!(o.hit_max_relative_sigma >= 0 && o.hit_max_relative_sigma <= 0.5)) {
    return out_of_range("hit_max_relative_sigma", o.hit_max_relative_sigma, "0 to 0.5");
  }
  if (!(o.hit_near >= 0)) return out_of_range("hit_near", o.hit_near, "at least 0");
  if (!(o.hit_min_share >= 0 && o.hit_min_share <= 1)) {
    return out_of_range("hit_min_share", o.hit_min_share, "0 to 1");
  }
  if (!(o.hit_min_of_peak >= 0 && o.hit_min_of_peak <= 1)) {
    return out_of_range("hit_min_of_peak", o.hit_min_of_peak, "0 to 1");
  }
  return {};
}

OccupancyMap::OccupancyMap(const MapOptions& options)
    : options_(options),
      voxels_(std::make_unique<VoxelStore>(LogOdds(options), options.voxel)),
      scratch_(std::make_unique<Scratch>(options)) {}

OccupancyMap::OccupancyMap(OccupancyMap&&) noexcept = default;
OccupancyMap& OccupancyMap::operator=(OccupancyMap&&) noexcept = default;
OccupancyMap::~OccupancyMap() = default;

Result<OccupancyMap> OccupancyMap::create(const MapOptions& options) {
  if (const Status status = check(options); !status) return status.error();
  return OccupancyMap(options);
}

Result<OccupancyMap> OccupancyMap::create(const MapOptions& options, std::unique_ptr<octomap::OcTree> tree) {
  MapOptions with_voxel = options;
  with_voxel.voxel = tree->getResolution();
  auto map = create(with_voxel);
  if (map) take_over(*tree, *map->voxels_);
  return map;
}

/// Evidence that is spread along the ray makes an obstacle where there is most of it, and none beside one
/// that is there already.
bool OccupancyMap::is_on_the_peak(const HitVoxel& voxel, float weight) const {
  constexpr double kSigmas = 2;
  constexpr double kFarthest = 8;                                          // voxels
  const double sigma = kDensityAtMean / std::max(voxel.certainty, 0.01F);  // voxels
  const double reach = std::min(kSigmas * sigma, kFarthest);
  const Eigen::Vector3d centre = centre_of(voxel.key, options_.voxel);
  const Eigen::Vector3d step = options_.voxel * voxel.ray.normalized();
  for (double steps = 1; steps <= reach; ++steps) {
    for (const double sign : {-1.0, 1.0}) {
      VoxelKey key;
      if (!key_of(centre + sign * steps * step, 1 / options_.voxel, key) || key == voxel.key) continue;
      const std::uint64_t code = morton_code(key);
      if (scratch_->pending.weight(code) > 1.1F * weight) return false;
      float log_odds = 0;
      if (voxels_->value_at(code, log_odds) && voxels_->is_occupied(log_odds)) return false;
    }
  }
  return true;
}

/// How much of a hit the map gets: 0 while it waits.
float OccupancyMap::believed(const HitVoxel& voxel) {
  const bool is_certain = voxel.certainty >= kCertainly;
  const float share = is_certain ? 1 : voxel.share;
  if (is_certain && (voxel.z < options_.hit_near || options_.looks_baseline == 0)) return share;
  float log_odds = 0;
  if (voxels_->value_at(voxel.code, log_odds) && voxels_->is_occupied(log_odds)) return share;
  if (!scratch_->is_new_place) return 0;  // nothing that the image before it did not tell
  const PendingHits::Evidence& evidence =
      scratch_->pending.add(voxel.code, share, static_cast<float>(voxel.count), scratch_->view);
  if (evidence.hits < 2 || !is_placed(evidence)) return 0;
  if (!is_certain && (evidence.points < kPointsOfAPeak || !is_on_the_peak(voxel, evidence.weight))) return 0;
  scratch_->pending.erase(voxel.code);
  return 1;
}

void OccupancyMap::believe_hits(MapChange& change) {
  const float whole = voxels_->rules().hit;
  scratch_->hits.clear();
  scratch_->occupied.clear();
  for (const HitVoxel& voxel : scratch_->finder.voxels()) {
    scratch_->occupied.push_back(voxel.code);
    const float share = believed(voxel);
    if (share > 0) scratch_->hits.push_back({voxel.code, share * whole});
  }
  change.hits = scratch_->hits.size();
  change.pending_hits = scratch_->pending.size();
}

/// Free cubes without the voxels that the same image shows occupied.
void OccupancyMap::find_free(MapChange& change) {
  Scratch& s = *scratch_;
  s.witnesses.clear();
  for (const Clearance& view : s.views) {
    if ((view.origin() - s.now.origin()).norm() >= options_.looks_baseline - kRounding)
      s.witnesses.push_back(&view);
  }
  s.free.clear();
  change.pending_free = mapping::find_free(s.now, s.witnesses, options_.looks_baseline == 0,
                                           s.ages.has_value(), options_.voxel, *voxels_, s.free);
  cut_out(s.free, s.occupied, s.scratch);
}

/// Counts the places at least the baseline apart.
void OccupancyMap::arrive_at(const Eigen::Vector3d& place) {
  Scratch& s = *scratch_;
  s.is_new_place = s.view == 0 || (place - s.place).norm() >= options_.looks_baseline - kRounding;
  if (!s.is_new_place) return;
  ++s.view;
  s.place = place;
  // A map of what waits is walked whole to forget: not each time.
  if (s.view % 4 == 0) s.pending.forget_before(s.view - kViewsUntilForgotten);
}

/// Not each time: where nothing moves there is nothing to pack.
void OccupancyMap::pack_far(const Eigen::Vector3d& place) {
  VoxelKey here;
  if (options_.pack_beyond == 0 || !key_of(place, 1 / options_.voxel, here)) return;
  constexpr int kStep = kPackedSide / 2;
  bool moved = !scratch_->packed_at;
  for (std::size_t axis = 0; axis < 3 && !moved; ++axis)
    moved = std::abs(int{here[axis]} - int{(*scratch_->packed_at)[axis]}) >= kStep;
  if (!moved) return;
  scratch_->packed_at = here;
  voxels_->pack_beyond(here, options_.pack_beyond / options_.voxel);
}

/// Keeps the view for the images to come, in place of the oldest.
void OccupancyMap::remember_view() {
  Scratch& s = *scratch_;
  if (!s.is_new_place || options_.looks_baseline == 0) return;
  if (s.views.size() < kViews) {
    s.views.push_back(s.now);
  } else {
    std::swap(s.views[s.oldest], s.now);
    s.oldest = (s.oldest + 1) % kViews;
  }
}

MapChange OccupancyMap::integrate(const DepthImage& image, const Camera& camera, const Pose& T_world_camera) {
  MapChange change;
  if (image.empty() || !is_usable(camera) || !is_usable(T_world_camera)) return change;
  const Camera cells = camera_of_cells(camera, image.window);
  arrive_at(T_world_camera.translation);
  scratch_->now.set(image, camera, T_world_camera,
                    {options_.range, options_.free_margin_sigmas, options_.free_hole, options_.voxel});
  scratch_->finder.find(image, cells, T_world_camera, change);
  believe_hits(change);
  find_free(change);
  if (scratch_->ages) {
    scratch_->ages->forget(image.time, *voxels_, change);
    scratch_->ages->see(scratch_->free);
  }
  voxels_->apply(scratch_->free, scratch_->hits, change);
  if (!change.became_unknown.empty()) put_in_order(change.touched);
  remember_view();
  pack_far(T_world_camera.translation);
  return change;
}

MapChange OccupancyMap::forget(Time now) {
  MapChange change;
  if (scratch_->ages) scratch_->ages->forget(now, *voxels_, change);
  put_in_order(change.touched);
  return change;
}

Occupancy OccupancyMap::at(const Eigen::Vector3d& point) const {
  VoxelKey key;
  float log_odds = 0;
  if (!key_of(point, 1 / options_.voxel, key) || !voxels_->value_at(morton_code(key), log_odds))
    return Occupancy::unknown;
  return voxels_->is_occupied(log_odds) ? Occupancy::occupied : Occupancy::free;
}

double OccupancyMap::probability(const Eigen::Vector3d& point) const {
  VoxelKey key;
  float log_odds = 0;
  if (!key_of(point, 1 / options_.voxel, key) || !voxels_->value_at(morton_code(key), log_odds))
    return std::numeric_limits<double>::quiet_NaN();
  return 1 - 1 / (1 + std::exp(static_cast<double>(log_odds)));
}

void OccupancyMap::for_each(const std::function<void(const MapCell&, Occupancy)>& visitor) const {
  voxels_->for_each([&](std::uint64_t code, unsigned depth, float log_odds) {
    visitor(cell_of(code, depth, options_.voxel),
            voxels_->is_occupied(log_odds) ? Occupancy::occupied : Occupancy::free);
  });
}

void OccupancyMap::for_each_leaf(const std::function<void(const MapLeaf&)>& visitor) const {
  voxels_->for_each([&](std::uint64_t code, unsigned depth, float log_odds) {
    visitor({code, depth, log_odds, voxels_->is_occupied(log_odds)});
  });
}

std::vector<MapCell> OccupancyMap::occupied() const {
  std::vector<MapCell> cells;
  for_each([&](const MapCell& cell, Occupancy state) {
    if (state == Occupancy::occupied) cells.push_back(cell);
  });
  return cells;
}

Eigen::AlignedBox3d OccupancyMap::bounds() const {
  Eigen::AlignedBox3d box;
  for_each([&](const MapCell& cell, Occupancy /*state*/) {
    const Eigen::Vector3d centre = cell.centre.cast<double>();
    box.extend(Eigen::Vector3d(centre.array() - 0.5 * cell.side));
    box.extend(Eigen::Vector3d(centre.array() + 0.5 * cell.side));
  });
  return box;
}

OccupancyMap::Counts OccupancyMap::counts() const {
  Counts counts;
  for_each([&](const MapCell& cell, Occupancy state) {
    const std::size_t voxels = std::size_t{1} << (3 * (kTreeDepth - cell.depth));
    (state == Occupancy::occupied ? counts.occupied : counts.free) += voxels;
  });
  return counts;
}

std::unique_ptr<octomap::OcTree> OccupancyMap::octree() const { return octree_of(*voxels_, options_); }

std::size_t OccupancyMap::memory() const { return voxels_->memory(); }

}  // namespace pade::mapping
