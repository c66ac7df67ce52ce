#include "pade/mapping/hit_finder.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

#include "pade/mapping/tiles/look_kernels.hpp"

namespace pade::mapping {
namespace {

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

/// A row of an image, or null where there is none.
template <class Value>
const Value* row_of(const cv::Mat& image, int v) {
  return image.empty() ? nullptr : image.ptr<Value>(v);
}

PixelRays rays_of(const Camera& cells, const Pose& T_world_camera, const Eigen::Matrix3d& R_world_camera,
                  int v, double voxel) {
  const Eigen::Vector3d start =
      R_world_camera * Eigen::Vector3d(-cells.cx / cells.fx, (v - cells.cy) / cells.fy, 1);
  const Eigen::Vector3d step = R_world_camera.col(0) / cells.fx;
  PixelRays rays{{}, {}, {}, 1 / voxel};
  for (int axis = 0; axis < 3; ++axis) {
    rays.origin[axis] = T_world_camera.translation[axis];
    rays.start[axis] = start[axis];
    rays.step[axis] = step[axis];
  }
  return rays;
}

}  // namespace

void HitFinder::find(const DepthImage& image, const Camera& cells, const Pose& T_world_camera,
                     MapChange& change) {
  count_points(image, cells, T_world_camera, change);
  voxels_.clear();
  for (const HitGrid::Tile* tile : grid_.tiles()) {
    const HitGrid::Around around = grid_.around(*tile);
    for (std::size_t eighth = 0; eighth < 8; ++eighth) {
      for (std::uint64_t rest = tile->hit[eighth]; rest != 0; rest &= rest - 1) {
        const std::size_t index = 64 * eighth + static_cast<std::size_t>(std::countr_zero(rest));
        const VoxelKey key{static_cast<std::uint16_t>(tile->key[0] | gathered_bits(index)),
                           static_cast<std::uint16_t>(tile->key[1] | gathered_bits(index >> 1U)),
                           static_cast<std::uint16_t>(tile->key[2] | gathered_bits(index >> 2U))};
        HitVoxel voxel = voxel_of(key, tile->counts[index], cells, T_world_camera);
        if (!is_hit(voxel, around)) continue;
        voxel.code = tile->code + index;
        voxels_.push_back(voxel);
      }
    }
  }
}

/// Counts the points per voxel.
void HitFinder::count_points(const DepthImage& image, const Camera& cells, const Pose& T_world_camera,
                             MapChange& change) {
  static_assert(static_cast<int>(DepthState::measured) == 0);
  const Eigen::Matrix3d R_world_camera = T_world_camera.matrix3();
  const double limit = options_.hit_max_relative_sigma * options_.hit_max_relative_sigma;
  // A surface beyond the range still takes its share of the points that noise has spread.
  const double farthest = options_.range + 3 * options_.voxel;
  const cv::Mat& own_variance = image.own_variance.empty() ? image.variance : image.own_variance;
  const simd::InstructionSet set = simd::best();
  const auto usable = PADE_DISPATCH(usable_depths, set);
  const auto place = PADE_DISPATCH(place_row, set);
  const int count = image.depth.cols;
  z_.resize(static_cast<std::size_t>(count));
  keys_.resize(z_.size());
  grid_.clear();
  for (int v = 0; v < image.depth.rows; ++v) {
    const auto* own = row_of<float>(own_variance, v);
    int uncertain = 0;
    int to_spread = 0;
    usable({image.depth.ptr<float>(v), row_of<float>(image.variance, v), own,
            row_of<std::uint8_t>(image.state, v), count},
           farthest, limit, options_.voxel * options_.voxel, z_.data(), &uncertain, &to_spread);
    change.too_uncertain += static_cast<std::size_t>(uncertain);
    if (to_spread > 0) spread_row(own, v, count);
    place(rays_of(cells, T_world_camera, R_world_camera, v, options_.voxel), z_.data(), count, keys_.data());
    add_row(count, to_spread > 0, change);
  }
}

/// An own sigma of more than a voxel is spread: each pixel takes one of 16 quantiles of its normal
/// distribution, each 4 x 4 pixels take all of them.
void HitFinder::spread_row(const float* own, int v, int count) {
  const double voxel = options_.voxel;
  certainty_.assign(static_cast<std::size_t>(count), HitGrid::kCertain);
  for (int u = 0; u < count; ++u) {
    if (!(own[u] > voxel * voxel)) continue;
    const auto i = static_cast<std::size_t>(u);
    const double sigma = std::sqrt(static_cast<double>(own[u]));
    z_[i] += sigma * quantile_at(u, v);
    certainty_[i] = static_cast<std::uint32_t>(HitGrid::kCertain * share_of_voxel(voxel / sigma));
  }
}

/// Neighbouring pixels that lie in one voxel are added together.
void HitFinder::add_row(int count, bool is_spread, MapChange& change) {
  std::uint64_t key = kNoPoint;
  std::uint32_t points = 0;
  std::uint32_t certainty = 0;
  const auto add = [&] {
    if (key < kPointOutside) grid_.add(key, points, is_spread ? certainty : points * HitGrid::kCertain);
    if (key == kPointOutside) change.outside += points;
  };
  for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
    if (keys_[i] != key) {
      add();
      key = keys_[i];
      points = 0;
      certainty = 0;
    }
    ++points;
    if (is_spread) certainty += certainty_[i];
  }
  add();
}

HitVoxel HitFinder::voxel_of(const VoxelKey& key, const HitGrid::Count& count, const Camera& cells,
                             const Pose& T_world_camera) const {
  HitVoxel voxel;
  voxel.key = key;
  voxel.ray = centre_of(key, options_.voxel) - T_world_camera.translation;
  voxel.z = std::max((T_world_camera.rotation.conjugate() * voxel.ray).z(), 0.5 * options_.voxel);
  const double pixels = cells.fx * cells.fy * options_.voxel * options_.voxel / (voxel.z * voxel.z);
  voxel.share = static_cast<float>(std::min(count.points / pixels, 1.0));
  voxel.count = count.points;
  voxel.certainty =
      static_cast<float>(count.certainty) / static_cast<float>(HitGrid::kCertain * count.points);
  return voxel;
}

/// Noise spreads the points of one surface over several voxels along the rays. Those that got few of them,
/// for their size in the image or beside the fullest of their neighbours, are not where the surface is.
bool HitFinder::is_hit(const HitVoxel& voxel, const HitGrid::Around& around) const {
  if (voxel.z > options_.range || voxel.share < options_.hit_min_share) return false;
  if (voxel.certainty < kCertainly)
    return true;  // spread on purpose: where most of it is, the looks will tell
  const auto most = voxel.count / std::max(options_.hit_min_of_peak, 1e-9);  // that a neighbour may have
  const VoxelKey& key = voxel.key;
  if (has_fuller_neighbour(around, key, most)) return false;
  // Farther out on the ray only the tails of the noise are left, and a thin thing before a wall must not be
  // taken for one: a fifth of what is asked of a neighbour is enough there.
  const double side = options_.voxel;
  const Eigen::Vector3d centre = centre_of(key, side);
  const Eigen::Vector3d step = side * voxel.ray.normalized();
  for (const double steps : {-3.0, -2.0, 2.0, 3.0}) {
    VoxelKey other;
    if (key_of(centre + steps * step, 1 / side, other) &&
        points_at(around, key, other[0], other[1], other[2]) > 5 * most)
      return false;
  }
  return true;
}

}  // namespace pade::mapping
