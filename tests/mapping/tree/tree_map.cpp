#include "mapping/tree/tree_map.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <utility>

#include <octomap/OcTree.h>

#include "pade/mapping/back_projection.hpp"

#include "mapping/tree/clearance.hpp"
#include "mapping/tree/map_update.hpp"
#include "mapping/tree/pending_hits.hpp"

namespace pade::mapping::tree {

class TreeMap::Tree : public UpdatableTree {
  using UpdatableTree::UpdatableTree;
};

/// A voxel that an image shows occupied.
struct TreeMap::HitVoxel {
  octomap::OcTreeKey key;
  std::uint64_t code = 0;
  Eigen::Vector3d ray;      ///< from the camera to its centre, world, m
  double z = 0;             ///< of its centre, m
  float certainty = 0;      ///< probability that a point that was found in it belongs to it
  std::uint32_t count = 0;  ///< points in it
  float share = 0;          ///< of the pixels that it covers, those whose point it holds: at most 1
};

struct TreeMap::Scratch {
  HitCounter counter;
  std::vector<HitVoxel> voxels;
  std::vector<CellUpdate> occupied;  // all voxels of `voxels`, whether or not they are believed
  std::vector<CellUpdate> hits, free, shown_free, updates;
  Clearance now;
  std::vector<const Clearance*> witnesses;
  // From image to image:
  std::vector<Clearance> views;  // the last few from places at least the baseline apart
  std::size_t oldest = 0;        // of `views`
  PendingHits pending;
  int view = 0;               // places at least the baseline apart, so far
  Eigen::Vector3d place;      // of the last of them
  bool is_new_place = false;  // this image is from the next one
};

namespace {

constexpr std::size_t kViews = 4;
constexpr int kViewsUntilForgotten = 20;
constexpr double kRounding = 1e-6;    // of a baseline, m
constexpr float kCertainly = 0.5F;    // most of the points are where they seem to be
constexpr float kPointsOfAPeak = 20;  // fewer, of all looks, do not tell a peak from chance

/// Key of the voxel that holds a point, by the arithmetic of OctoMap's coordToKey. `per_voxel` = 1 / voxel.
bool to_key(const Eigen::Vector3d& point, double per_voxel, octomap::OcTreeKey& key) {
  for (int axis = 0; axis < 3; ++axis) {
    const double index = per_voxel * point[axis] + kTreeCentre;
    if (!(index >= 0 && index < 2 * kTreeCentre)) return false;
    key[static_cast<unsigned>(axis)] = static_cast<octomap::key_type>(index);
  }
  return true;
}

Eigen::Vector3d centre_of(const octomap::OcTreeKey& key, double voxel) {
  return voxel * (Eigen::Vector3d(key[0], key[1], key[2]).array() + (0.5 - kTreeCentre));
}

constexpr double kDensityAtMean = 0.3989;  // of the standard normal distribution

/// Probability that a surface lies in the voxel that holds its mean, for sigma of at least a voxel.
double share_of_voxel(double voxel_per_sigma) { return kDensityAtMean * std::min(voxel_per_sigma, 1.0); }

/// Quantiles (i + 1/2) / 16 of the standard normal distribution, in the order of Bayer's ordered dither.
double quantile_at(int u, int v) {
  constexpr std::array<double, 16> kQuantiles = {-1.8627, -1.3180, -1.0100, -0.7764, -0.5791, -0.4023,
                                                 -0.2372, -0.0784, 0.0784,  0.2372,  0.4023,  0.5791,
                                                 0.7764,  1.0100,  1.3180,  1.8627};
  constexpr std::array<std::uint8_t, 16> kBayer = {0, 8, 2, 10, 12, 4, 14, 6, 3, 11, 1, 9, 15, 7, 13, 5};
  return kQuantiles[kBayer[static_cast<std::size_t>(v % 4 * 4 + u % 4)]];
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

}  // namespace

TreeMap::TreeMap(const MapOptions& options)
    : options_(options), tree_(std::make_unique<Tree>(options.voxel)), scratch_(std::make_unique<Scratch>()) {
  tree_->setProbHit(options.p_hit);
  tree_->setProbMiss(options.p_miss);
  tree_->setClampingThresMin(options.clamp_min);
  tree_->setClampingThresMax(options.clamp_max);
  tree_->setOccupancyThres(options.occupancy_threshold);
}

TreeMap::TreeMap(TreeMap&&) noexcept = default;
TreeMap& TreeMap::operator=(TreeMap&&) noexcept = default;
TreeMap::~TreeMap() = default;

Result<TreeMap> TreeMap::create(const MapOptions& options) {
  if (const Status status = check(options); !status) return status.error();
  return TreeMap(options);
}

Result<TreeMap> TreeMap::create(const MapOptions& options, std::unique_ptr<octomap::OcTree> tree) {
  MapOptions with_voxel = options;
  with_voxel.voxel = tree->getResolution();
  auto map = create(with_voxel);
  if (map) map->tree_->swapContent(*tree);
  return map;
}

/// Counts the points per voxel. An own sigma of more than a voxel is spread: each pixel takes one of 16
/// quantiles of its normal distribution, each 4 x 4 pixels take all of them.
void TreeMap::count_points(const DepthImage& image, const Camera& cells, const Pose& T_world_camera,
                           MapChange& change) {
  const Eigen::Matrix3d R_world_camera = T_world_camera.matrix3();
  const double voxel = options_.voxel;
  const double limit = options_.hit_max_relative_sigma * options_.hit_max_relative_sigma;
  // A surface beyond the range still takes its share of the points that noise has spread.
  const double farthest = options_.range + 3 * voxel;
  const double per_voxel = 1 / voxel;
  const cv::Mat& own_variance = image.own_variance.empty() ? image.variance : image.own_variance;
  HitCounter& counter = scratch_->counter;
  counter.clear();
  for (int v = 0; v < image.depth.rows; ++v) {
    const auto* depth = image.depth.ptr<float>(v);
    const auto* variance = image.variance.empty() ? nullptr : image.variance.ptr<float>(v);
    const auto* own = own_variance.empty() ? nullptr : own_variance.ptr<float>(v);
    const auto* state = image.state.empty() ? nullptr : image.state.ptr<std::uint8_t>(v);
    const Eigen::Vector3d row =
        R_world_camera * Eigen::Vector3d(-cells.cx / cells.fx, (v - cells.cy) / cells.fy, 1);
    const Eigen::Vector3d column = R_world_camera.col(0) / cells.fx;
    for (int u = 0; u < image.depth.cols; ++u) {
      double z = depth[u];
      if (!(z > 0 && z <= farthest)) continue;
      if (state != nullptr && state[u] != static_cast<std::uint8_t>(DepthState::measured)) continue;
      if (variance != nullptr && !(variance[u] <= limit * z * z)) {
        ++change.too_uncertain;
        continue;
      }
      std::uint32_t certainty = HitCounter::kCertain;
      if (own != nullptr && own[u] > voxel * voxel) {
        const double sigma = std::sqrt(static_cast<double>(own[u]));
        z += sigma * quantile_at(u, v);
        certainty = static_cast<std::uint32_t>(HitCounter::kCertain * share_of_voxel(voxel / sigma));
      }
      octomap::OcTreeKey key;
      if (to_key(T_world_camera.translation + z * (row + u * column), per_voxel, key)) {
        counter.add(key, certainty);
      } else {
        ++change.outside;
      }
    }
  }
}

/// Noise spreads the points of one surface over several voxels along the rays. Those that got few of them,
/// for their size in the image or beside the fullest of their neighbours, are not where the surface is.
bool TreeMap::is_hit(const HitVoxel& voxel) const {
  if (voxel.z > options_.range || voxel.share < options_.hit_min_share) return false;
  if (voxel.certainty < kCertainly)
    return true;  // spread on purpose: where most of it is, the looks will tell
  const double side = options_.voxel;
  const HitCounter& counter = scratch_->counter;
  const auto most = voxel.count / std::max(options_.hit_min_of_peak, 1e-9);  // that a neighbour may have
  for (int i = 0; i < 27; ++i) {
    const octomap::OcTreeKey neighbour(static_cast<octomap::key_type>(voxel.key[0] + i % 3 - 1),
                                       static_cast<octomap::key_type>(voxel.key[1] + i / 3 % 3 - 1),
                                       static_cast<octomap::key_type>(voxel.key[2] + i / 9 - 1));
    if (counter.count(neighbour) > most) return false;
  }
  // Farther out on the ray only the tails of the noise are left, and a thin thing before a wall must not be
  // taken for one: a fifth of what is asked of a neighbour is enough there.
  const Eigen::Vector3d centre = centre_of(voxel.key, side);
  const Eigen::Vector3d step = side * voxel.ray.normalized();
  for (const double steps : {-3.0, -2.0, 2.0, 3.0}) {
    octomap::OcTreeKey neighbour;
    if (to_key(centre + steps * step, 1 / side, neighbour) && counter.count(neighbour) > 5 * most)
      return false;
  }
  return true;
}

/// Keeps the voxels that enough of their pixels agree on, in Morton order.
void TreeMap::find_hits(const Camera& cells, const Pose& T_world_camera) {
  std::vector<HitVoxel>& voxels = scratch_->voxels;
  voxels.clear();
  for (const HitCounter::Hit& hit : scratch_->counter.hits()) {
    HitVoxel voxel;
    voxel.key = hit.key;
    voxel.ray = centre_of(hit.key, options_.voxel) - T_world_camera.translation;
    voxel.z = std::max((T_world_camera.rotation.conjugate() * voxel.ray).z(), 0.5 * options_.voxel);
    const double pixels = cells.fx * cells.fy * options_.voxel * options_.voxel / (voxel.z * voxel.z);
    voxel.share = static_cast<float>(std::min(hit.count / pixels, 1.0));
    voxel.count = hit.count;
    voxel.certainty =
        static_cast<float>(hit.certainty) / static_cast<float>(HitCounter::kCertain * hit.count);
    if (!is_hit(voxel)) continue;
    voxel.code = morton_code(hit.key);
    voxels.push_back(voxel);
  }
  std::sort(voxels.begin(), voxels.end(),
            [](const HitVoxel& a, const HitVoxel& b) { return a.code < b.code; });
  scratch_->occupied.clear();
  for (const HitVoxel& voxel : voxels) scratch_->occupied.push_back({voxel.code, kTreeDepth, 0});
}

/// Evidence that is spread along the ray makes an obstacle where there is most of it, and none beside one
/// that is there already.
bool TreeMap::is_on_the_peak(const HitVoxel& voxel, float weight) const {
  constexpr double kSigmas = 2;
  constexpr double kFarthest = 8;                                          // voxels
  const double sigma = kDensityAtMean / std::max(voxel.certainty, 0.01F);  // voxels
  const double reach = std::min(kSigmas * sigma, kFarthest);
  const Eigen::Vector3d centre = centre_of(voxel.key, options_.voxel);
  const Eigen::Vector3d step = options_.voxel * voxel.ray.normalized();
  for (double steps = 1; steps <= reach; ++steps) {
    for (const double sign : {-1.0, 1.0}) {
      octomap::OcTreeKey key;
      if (!to_key(centre + sign * steps * step, 1 / options_.voxel, key) || key == voxel.key) continue;
      if (scratch_->pending.weight(morton_code(key)) > 1.1F * weight) return false;
      const octomap::OcTreeNode* node = tree_->search(key);
      if (node != nullptr && tree_->isNodeOccupied(node)) return false;
    }
  }
  return true;
}

/// How much of a hit the map gets: 0 while it waits.
float TreeMap::believed(const HitVoxel& voxel) {
  const bool is_certain = voxel.certainty >= kCertainly;
  const float share = is_certain ? 1 : voxel.share;
  if (is_certain && (voxel.z < options_.hit_near || options_.looks_baseline == 0)) return share;
  const octomap::OcTreeNode* node = tree_->search(voxel.key);
  if (node != nullptr && tree_->isNodeOccupied(node)) return share;
  if (!scratch_->is_new_place) return 0;  // nothing that the image before it did not tell
  const PendingHits::Evidence& evidence =
      scratch_->pending.add(voxel.code, share, static_cast<float>(voxel.count), scratch_->view);
  if (evidence.hits < 2 || !is_placed(evidence)) return 0;
  if (!is_certain && (evidence.points < kPointsOfAPeak || !is_on_the_peak(voxel, evidence.weight))) return 0;
  scratch_->pending.erase(voxel.code);
  return 1;
}

void TreeMap::believe_hits(MapChange& change) {
  const float whole = tree_->getProbHitLog();
  scratch_->hits.clear();
  for (const HitVoxel& voxel : scratch_->voxels) {
    const float share = believed(voxel);
    if (share > 0) scratch_->hits.push_back({voxel.code, kTreeDepth, share * whole});
  }
  change.hits = scratch_->hits.size();
  change.pending_hits = scratch_->pending.size();
}

/// Free cubes without the voxels that the same image shows occupied.
void TreeMap::find_free(MapChange& change) {
  Scratch& s = *scratch_;
  s.witnesses.clear();
  for (const Clearance& view : s.views) {
    if ((view.origin() - s.now.origin()).norm() >= options_.looks_baseline - kRounding)
      s.witnesses.push_back(&view);
  }
  s.shown_free.clear();
  s.free.clear();
  change.pending_free = find_free_cells(s.now, s.witnesses, options_.looks_baseline == 0, options_.voxel,
                                        tree_->getProbMissLog(), s.shown_free);
  cut_out(s.shown_free, s.occupied, s.free);
}

/// Counts the places at least the baseline apart.
void TreeMap::arrive_at(const Eigen::Vector3d& place) {
  Scratch& s = *scratch_;
  s.is_new_place = s.view == 0 || (place - s.place).norm() >= options_.looks_baseline - kRounding;
  if (!s.is_new_place) return;
  ++s.view;
  s.place = place;
  // A map of what waits is walked whole to forget: not each time.
  if (s.view % 4 == 0) s.pending.forget_before(s.view - kViewsUntilForgotten);
}

/// Keeps the view for the images to come, in place of the oldest.
void TreeMap::remember_view() {
  Scratch& s = *scratch_;
  if (!s.is_new_place || options_.looks_baseline == 0) return;
  if (s.views.size() < kViews) {
    s.views.push_back(s.now);
  } else {
    std::swap(s.views[s.oldest], s.now);
    s.oldest = (s.oldest + 1) % kViews;
  }
}

MapChange TreeMap::integrate(const DepthImage& image, const Camera& camera, const Pose& T_world_camera) {
  MapChange change;
  if (image.empty() || !T_world_camera.is_finite()) return change;
  const Camera cells = camera_of_cells(camera, image.window);
  arrive_at(T_world_camera.translation);
  scratch_->now.set(image, camera, T_world_camera,
                    {options_.range, options_.free_margin_sigmas, options_.free_hole, options_.voxel});
  count_points(image, cells, T_world_camera, change);
  find_hits(cells, T_world_camera);
  believe_hits(change);
  find_free(change);

  scratch_->updates.resize(scratch_->hits.size() + scratch_->free.size());
  std::merge(scratch_->hits.begin(), scratch_->hits.end(), scratch_->free.begin(), scratch_->free.end(),
             scratch_->updates.begin(),
             [](const CellUpdate& a, const CellUpdate& b) { return a.code < b.code; });
  tree_->apply(scratch_->updates, change);
  remember_view();
  return change;
}

const octomap::OcTreeNode* TreeMap::find(const Eigen::Vector3d& point) const {
  octomap::OcTreeKey key;
  return to_key(point, 1 / options_.voxel, key) ? tree_->search(key) : nullptr;
}

Occupancy TreeMap::at(const Eigen::Vector3d& point) const {
  const octomap::OcTreeNode* node = find(point);
  if (node == nullptr) return Occupancy::unknown;
  return tree_->isNodeOccupied(node) ? Occupancy::occupied : Occupancy::free;
}

double TreeMap::probability(const Eigen::Vector3d& point) const {
  const octomap::OcTreeNode* node = find(point);
  return node != nullptr ? node->getOccupancy() : std::numeric_limits<double>::quiet_NaN();
}

void TreeMap::for_each(const std::function<void(const MapCell&, Occupancy)>& visitor) const {
  const octomap::OcTree& tree = *tree_;
  for (auto leaf = tree.begin_leafs(), end = tree.end_leafs(); leaf != end; ++leaf) {
    const std::uint64_t code = morton_code(leaf.getKey());
    const unsigned below = 3 * (kTreeDepth - leaf.getDepth());
    const MapCell cell = cell_of(code >> below << below, leaf.getDepth(), options_.voxel);
    visitor(cell, tree.isNodeOccupied(*leaf) ? Occupancy::occupied : Occupancy::free);
  }
}

std::vector<MapCell> TreeMap::occupied() const {
  std::vector<MapCell> cells;
  for_each([&](const MapCell& cell, Occupancy state) {
    if (state == Occupancy::occupied) cells.push_back(cell);
  });
  return cells;
}

Eigen::AlignedBox3d TreeMap::bounds() const {
  Eigen::AlignedBox3d box;
  for_each([&](const MapCell& cell, Occupancy /*state*/) {
    const Eigen::Vector3d centre = cell.centre.cast<double>();
    box.extend(Eigen::Vector3d(centre.array() - 0.5 * cell.side));
    box.extend(Eigen::Vector3d(centre.array() + 0.5 * cell.side));
  });
  return box;
}

TreeMap::Counts TreeMap::counts() const {
  Counts counts;
  for_each([&](const MapCell& cell, Occupancy state) {
    const std::size_t voxels = std::size_t{1} << (3 * (kTreeDepth - cell.depth));
    (state == Occupancy::occupied ? counts.occupied : counts.free) += voxels;
  });
  return counts;
}

const octomap::OcTree& TreeMap::tree() const { return *tree_; }

}  // namespace pade::mapping::tree
