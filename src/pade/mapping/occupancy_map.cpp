#include "pade/mapping/occupancy_map.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include "pade/mapping/back_projection.hpp"
#include "pade/mapping/clearance.hpp"
#include "pade/mapping/map_update.hpp"

namespace pade::mapping {

class OccupancyMap::Tree : public UpdatableTree {
  using UpdatableTree::UpdatableTree;
};

struct OccupancyMap::Scratch {
  HitCounter counter;
  std::vector<CellUpdate> hits, free, updates;
  Clearance clearance;
};

namespace {

Error out_of_range(const char* option, double value, const std::string& expected) {
  return Error{"option " + std::string(option) + " is " + std::to_string(value) + ", expected " + expected};
}

Status check(const MapOptions& o) {
  const auto finite_positive = [](double value) { return value > 0 && std::isfinite(value); };
  if (!(o.voxel >= 0.001 && o.voxel <= 100)) return out_of_range("voxel", o.voxel, "0.001 to 100 m");
  if (!finite_positive(o.range)) return out_of_range("range", o.range, "a positive number of metres");
  if (!(o.p_hit > 0.5 && o.p_hit < 1)) return out_of_range("p_hit", o.p_hit, "above 0.5 and below 1");
  if (!(o.p_miss > 0 && o.p_miss < 0.5)) return out_of_range("p_miss", o.p_miss, "above 0 and below 0.5");
  if (!(o.clamp_min > 0 && o.clamp_min < o.clamp_max)) {
    return out_of_range("clamp_min", o.clamp_min, "above 0 and below clamp_max");
  }
  if (!(o.clamp_max < 1)) return out_of_range("clamp_max", o.clamp_max, "below 1");
  if (!(o.occupancy_threshold > o.clamp_min && o.occupancy_threshold < o.clamp_max)) {
    return out_of_range("occupancy_threshold", o.occupancy_threshold, "between clamp_min and clamp_max");
  }
  if (!(o.free_margin_sigmas >= 0))
    return out_of_range("free_margin_sigmas", o.free_margin_sigmas, "at least 0");
  if (!(o.hit_max_sigma >= 0)) return out_of_range("hit_max_sigma", o.hit_max_sigma, "at least 0");
  if (!(o.hit_min_share >= 0 && o.hit_min_share <= 1)) {
    return out_of_range("hit_min_share", o.hit_min_share, "0 to 1");
  }
  if (!(o.hit_min_of_peak >= 0 && o.hit_min_of_peak <= 1)) {
    return out_of_range("hit_min_of_peak", o.hit_min_of_peak, "0 to 1");
  }
  if (!(o.free_min_known > 0 && o.free_min_known <= 1)) {
    return out_of_range("free_min_known", o.free_min_known, "above 0, at most 1");
  }
  return {};
}

/// Key of the voxel that holds a point, by the arithmetic of OctoMap's coordToKey. `per_voxel` = 1 / voxel.
bool to_key(const Eigen::Vector3d& point, double per_voxel, octomap::OcTreeKey& key) {
  for (int axis = 0; axis < 3; ++axis) {
    const double index = per_voxel * point[axis] + kTreeCentre;
    if (!(index >= 0 && index < 2 * kTreeCentre)) return false;
    key[static_cast<unsigned>(axis)] = static_cast<octomap::key_type>(index);
  }
  return true;
}

}  // namespace

OccupancyMap::OccupancyMap(const MapOptions& options)
    : options_(options), tree_(std::make_unique<Tree>(options.voxel)), scratch_(std::make_unique<Scratch>()) {
  tree_->setProbHit(options.p_hit);
  tree_->setProbMiss(options.p_miss);
  tree_->setClampingThresMin(options.clamp_min);
  tree_->setClampingThresMax(options.clamp_max);
  tree_->setOccupancyThres(options.occupancy_threshold);
}

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
  if (map) map->tree_->swapContent(*tree);
  return map;
}

/// Noise spreads the points of one surface over several voxels along the rays. Those that got few of them,
/// for their size in the image or beside the fullest of their neighbours, are not where the surface is.
bool OccupancyMap::is_hit(const octomap::OcTreeKey& key, std::uint32_t count, const Camera& cells,
                          const Pose& T_world_camera) const {
  const double voxel = options_.voxel;
  const Eigen::Vector3d centre =
      voxel * (Eigen::Vector3d(key[0], key[1], key[2]).array() + (0.5 - kTreeCentre));
  const Eigen::Vector3d ray = centre - T_world_camera.translation;
  const double z = std::max((T_world_camera.rotation.conjugate() * ray).z(), 0.5 * voxel);
  if (z > options_.range) return false;
  const double pixels = cells.fx * cells.fy * voxel * voxel / (z * z);  // that the voxel covers
  if (count < options_.hit_min_share * pixels) return false;

  const HitCounter& counter = scratch_->counter;
  const auto most = count / std::max(options_.hit_min_of_peak, 1e-9);  // that a neighbour may have
  for (int i = 0; i < 27; ++i) {
    const octomap::OcTreeKey neighbour(static_cast<octomap::key_type>(key[0] + i % 3 - 1),
                                       static_cast<octomap::key_type>(key[1] + i / 3 % 3 - 1),
                                       static_cast<octomap::key_type>(key[2] + i / 9 - 1));
    if (counter.count(neighbour) > most) return false;
  }
  // Farther out on the ray only the tails of the noise are left, and a thin thing before a wall must not be
  // taken for one: a fifth of what is asked of a neighbour is enough there.
  const Eigen::Vector3d step = voxel * ray.normalized();
  for (const double steps : {-3.0, -2.0, 2.0, 3.0}) {
    octomap::OcTreeKey neighbour;
    if (to_key(centre + steps * step, 1 / voxel, neighbour) && counter.count(neighbour) > 5 * most)
      return false;
  }
  return true;
}

/// Counts the points per voxel and keeps the voxels that enough of their pixels agree on.
std::size_t OccupancyMap::find_hits(const DepthImage& image, const Camera& camera,
                                    const Pose& T_world_camera) {
  const Camera cells = camera_of_cells(camera, image.window);
  const Eigen::Matrix3d R_world_camera = T_world_camera.matrix3();
  const double max_variance = options_.hit_max_sigma * options_.hit_max_sigma;
  // A surface beyond the range still takes its share of the points that noise has spread.
  const double farthest = options_.range + 3 * options_.voxel;
  const double per_voxel = 1 / options_.voxel;
  HitCounter& counter = scratch_->counter;
  counter.clear();
  std::size_t outside = 0;
  for (int v = 0; v < image.depth.rows; ++v) {
    const auto* depth = image.depth.ptr<float>(v);
    const auto* variance = image.variance.empty() ? nullptr : image.variance.ptr<float>(v);
    const auto* state = image.state.empty() ? nullptr : image.state.ptr<std::uint8_t>(v);
    const Eigen::Vector3d row =
        R_world_camera * Eigen::Vector3d(-cells.cx / cells.fx, (v - cells.cy) / cells.fy, 1);
    const Eigen::Vector3d column = R_world_camera.col(0) / cells.fx;
    for (int u = 0; u < image.depth.cols; ++u) {
      const double z = depth[u];
      if (!(z > 0 && z <= farthest)) continue;
      if (variance != nullptr && !(variance[u] <= max_variance)) continue;
      if (state != nullptr && state[u] != static_cast<std::uint8_t>(DepthState::measured)) continue;
      octomap::OcTreeKey key;
      if (to_key(T_world_camera.translation + z * (row + u * column), per_voxel, key)) {
        counter.add(key);
      } else {
        ++outside;
      }
    }
  }

  scratch_->hits.clear();
  for (const HitCounter::Hit& hit : counter.hits()) {
    if (is_hit(hit.key, hit.count, cells, T_world_camera)) {
      scratch_->hits.push_back({morton_code(hit.key), kTreeDepth, true});
    }
  }
  std::sort(scratch_->hits.begin(), scratch_->hits.end(),
            [](const CellUpdate& a, const CellUpdate& b) { return a.code < b.code; });
  return outside;
}

MapChange OccupancyMap::integrate(const DepthImage& image, const Camera& camera, const Pose& T_world_camera) {
  MapChange change;
  if (image.empty() || !T_world_camera.is_finite()) return change;
  change.outside = find_hits(image, camera, T_world_camera);
  change.hits = scratch_->hits.size();

  scratch_->clearance.set(image, camera, T_world_camera,
                          {options_.range, options_.free_margin_sigmas, options_.free_min_known});
  scratch_->free.clear();
  find_free_cells(scratch_->clearance, options_.voxel, scratch_->free);

  // No voxel is in both: a free one ends before Z of every pixel that sees it, a hit one contains such a
  // point.
  scratch_->updates.resize(scratch_->hits.size() + scratch_->free.size());
  std::merge(scratch_->hits.begin(), scratch_->hits.end(), scratch_->free.begin(), scratch_->free.end(),
             scratch_->updates.begin(),
             [](const CellUpdate& a, const CellUpdate& b) { return a.code < b.code; });
  tree_->apply(scratch_->updates, change);
  return change;
}

const octomap::OcTreeNode* OccupancyMap::find(const Eigen::Vector3d& point) const {
  octomap::OcTreeKey key;
  return to_key(point, 1 / options_.voxel, key) ? tree_->search(key) : nullptr;
}

Occupancy OccupancyMap::at(const Eigen::Vector3d& point) const {
  const octomap::OcTreeNode* node = find(point);
  if (node == nullptr) return Occupancy::unknown;
  return tree_->isNodeOccupied(node) ? Occupancy::occupied : Occupancy::free;
}

double OccupancyMap::probability(const Eigen::Vector3d& point) const {
  const octomap::OcTreeNode* node = find(point);
  return node != nullptr ? node->getOccupancy() : std::numeric_limits<double>::quiet_NaN();
}

void OccupancyMap::for_each(const std::function<void(const MapCell&, Occupancy)>& visitor) const {
  const octomap::OcTree& tree = *tree_;
  for (auto leaf = tree.begin_leafs(), end = tree.end_leafs(); leaf != end; ++leaf) {
    const std::uint64_t code = morton_code(leaf.getKey());
    const unsigned below = 3 * (kTreeDepth - leaf.getDepth());
    const MapCell cell = cell_of(code >> below << below, leaf.getDepth(), options_.voxel);
    visitor(cell, tree.isNodeOccupied(*leaf) ? Occupancy::occupied : Occupancy::free);
  }
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

const octomap::OcTree& OccupancyMap::tree() const { return *tree_; }

}  // namespace pade::mapping
