// The map in tiles against the same map on OctoMap's octree, voxel by voxel: not only the same classes but
// the same log-odds, bit for bit, and the same counts.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <random>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <octomap/OcTree.h>

#include "pade/core/compute/simd.hpp"
#include "pade/mapping/occupancy_map.hpp"
#include "pade/mapping/tiles/look_kernels.hpp"
#include "pade/mapping/tiles/octree.hpp"
#include "pade/mapping/tiles/voxel_store.hpp"

#include "mapping/flown_map.hpp"
#include "mapping/tree/map_update.hpp"
#include "mapping/tree/tree_map.hpp"

namespace pade::mapping {
namespace {

using Eigen::Vector3d;

const Camera kSmallCamera = simulation::analytic_camera(128, 96);

struct Leaf {
  std::uint64_t code;
  unsigned depth;
  float log_odds;
  bool operator==(const Leaf&) const = default;
};

std::vector<Leaf> leaves_of(const VoxelStore& store) {
  std::vector<Leaf> leaves;
  store.for_each([&](std::uint64_t code, unsigned depth, float log_odds) {
    leaves.push_back({code, depth, log_odds});
  });
  return leaves;
}

/// Both maps fed with the same images.
class Pair {
 public:
  explicit Pair(const MapOptions& options)
      : options_(options),
        ours_(std::move(OccupancyMap::create(options)).value()),
        theirs_(std::move(tree::TreeMap::create(options)).value()) {}

  void integrate(const DepthImage& image, const Camera& camera, const Pose& pose) {
    const MapChange a = ours_.integrate(image, camera, pose);
    const MapChange b = theirs_.integrate(image, camera, pose);
    EXPECT_EQ(a.hits, b.hits);
    EXPECT_EQ(a.pending_hits, b.pending_hits);
    EXPECT_EQ(a.too_uncertain, b.too_uncertain);
    EXPECT_EQ(a.outside, b.outside);
    EXPECT_LE(a.pending_free, b.pending_free);  // ours leaves out what is as free as can be
    EXPECT_EQ(voxels(a.became_free), voxels(b.became_free));
    EXPECT_EQ(voxels(a.became_occupied), voxels(b.became_occupied));
  }

  /// @return leaves
  std::size_t compare() const {
    VoxelStore store(LogOdds(options_), options_.voxel);
    take_over(theirs_.tree(), store);
    const auto ours = leaves_of(ours_.voxels());
    EXPECT_EQ(ours, leaves_of(store));
    EXPECT_EQ(ours_.octree()->size(), theirs_.tree().size());
    return ours.size();
  }

 private:
  static std::vector<std::uint64_t> voxels(const std::vector<MapCell>& cells) {
    std::vector<std::uint64_t> all;
    for (const MapCell& cell : cells) {
      for (std::uint64_t i = 0; i < voxels_of(cell.depth); ++i) all.push_back(morton_code(cell.key) + i);
    }
    EXPECT_TRUE(std::is_sorted(all.begin(), all.end()));
    return all;
  }
  MapOptions options_;
  OccupancyMap ours_;
  tree::TreeMap theirs_;
};

simulation::AnalyticFlight tilted_flight(const char* name, int frames) {
  simulation::AnalyticFlight flight = *simulation::make_analytic_flight(name, frames, kSmallCamera);
  for (Pose& pose : flight.T_world_camera) {
    pose.rotation = pose.rotation * rotation_exp({0.11, -0.07, 0.13});
    pose.translation += Vector3d(0.0123, 0.0456, 0.0371);
  }
  return flight;
}

/// Bounds as an image has them: of each pixel, now and then unknown.
void add_bounds(DepthImage& image, std::mt19937_64& random) {
  std::uniform_real_distribution<float> share(0.3F, 0.98F);
  image.bound = image.depth.clone();
  for (float& bound : cv::Mat_<float>(image.bound)) {
    const float part = share(random);
    bound = random() % 20 == 0  ? std::numeric_limits<float>::quiet_NaN()
            : std::isnan(bound) ? 18 * part
                                : bound * part;
  }
}

TEST(TreeAgreement, FlightsGiveTheSameLogOddsBitForBit) {
  std::mt19937_64 random(1);
  for (const char* name : {"forward", "courtyard"}) {
    for (const bool has_bounds : {false, true}) {
      for (const double baseline : {0.0, 0.1}) {
        MapOptions options;
        options.looks_baseline = baseline;
        Pair pair(options);
        const auto flight = tilted_flight(name, 6);
        for (int k = 0; k < 8; ++k) {
          const auto i = static_cast<std::size_t>(k % 6);
          DepthImage image = depth_image(flight, i, k % 3 == 0 ? 0.05 : 0.01);
          if (has_bounds) add_bounds(image, random);
          pair.integrate(image, kSmallCamera, flight.T_world_camera[i]);
        }
        EXPECT_GT(pair.compare(), 3000U) << name << " " << has_bounds << " " << baseline;
      }
    }
  }
}

TEST(TreeAgreement, ImagesPosesAndOptionsAtRandomGiveTheSameLogOddsBitForBit) {
  for (std::uint64_t seed = 1; seed <= 16; ++seed) {
    std::mt19937_64 random(seed);
    std::uniform_real_distribution<double> unit(-1, 1);
    MapOptions options;
    options.voxel = std::array{0.05, 0.1, 0.25, 0.7}[random() % 4];
    options.range = 4 + 8 * (1 + unit(random));
    options.p_hit = 0.7 + 0.2 * unit(random);
    options.p_miss = 0.35 + 0.1 * unit(random);
    options.looks_baseline = seed % 3 == 0 ? 0 : 0.1;
    options.hit_near = 4 * (1 + unit(random));
    options.free_hole = 0.1 * (1 + unit(random));
    Pair pair(options);
    for (int k = 0; k < 8; ++k) {
      DepthImage image;
      image.window = static_cast<int>(1 + random() % 4);
      const int height = (kSmallCamera.height + image.window - 1) / image.window;
      const int width = (kSmallCamera.width + image.window - 1) / image.window;
      image.depth.create(height, width, CV_32FC1);
      const double base = 2 + 6 * (1 + unit(random));
      const double slope = 0.03 * image.window * unit(random);
      for (int v = 0; v < height; ++v) {
        for (int u = 0; u < width; ++u) {
          const double z = base + slope * u + (random() % 9 == 0 ? 3 * unit(random) : 0.02 * unit(random));
          image.depth.at<float>(v, u) =
              random() % 11 == 0 ? std::numeric_limits<float>::quiet_NaN() : static_cast<float>(z);
        }
      }
      const double relative = 0.1 * (1 + unit(random));
      image.variance = relative * relative * image.depth.mul(image.depth);
      if (random() % 2 == 0) image.own_variance = 0.1 * image.variance;
      if (random() % 2 == 0) add_bounds(image, random);
      Pose pose;
      pose.rotation = rotation_exp({0.3 * unit(random), 0.3 * unit(random), 3 * unit(random)});
      pose.translation = seed % 5 == 0 ? Vector3d(32767 * options.voxel, 0, 0)
                                       : Vector3d(0.2 * k, unit(random), unit(random));
      pair.integrate(image, kSmallCamera, pose);
    }
    pair.compare();
  }
}

TEST(TreeAgreement, ATreeThatIsTakenOverComesBackAsItWas) {
  const auto flight = tilted_flight("courtyard", 4);
  const OccupancyMap map = map_of(flight, 0.01);
  const OccupancyMap again = std::move(OccupancyMap::create({}, map.octree())).value();
  EXPECT_EQ(leaves_of(map.voxels()), leaves_of(again.voxels()));
  tree::UpdatableTree growing(0.1);  // and a cube larger than any that an image makes
  MapChange change;
  growing.apply(std::array{tree::CellUpdate{0, 0, -0.4F}}, change);
  auto tree = std::make_unique<octomap::OcTree>(0.1);
  tree->swapContent(growing);
  const OccupancyMap all = std::move(OccupancyMap::create({}, std::move(tree))).value();
  EXPECT_EQ(leaves_of(all.voxels()), (std::vector<Leaf>{{0, 0, -0.4F}}));
  EXPECT_EQ(all.at({1, 2, 3}), Occupancy::free);
}

/// Which cubes and which of 64 voxels are free: the same bits on each instruction set, whatever else is
/// asked.
TEST(LookKernels, GiveTheSameBitsOnEachInstructionSet) {
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> unit(-1, 1);
  constexpr int kWidth = 100;
  constexpr int kHeight = 70;
  std::vector<float> ends(static_cast<std::size_t>(kWidth + 8) * kHeight);
  for (std::size_t i = 0; i < ends.size(); ++i)
    ends[i] = static_cast<float>(i % (kWidth + 8) < 50 ? 6 + unit(random) : 4);
  EndsLevel level;
  level.nearest = level.farthest[0] = ends.data();
  level.stride = kWidth + 8;
  LookView view{90, 90, 49.5, 34.5, kWidth, kHeight, 20, 0.1, {}, {0.8, 0.8, 0.7}, {}, {}, &level, 1};
  for (auto& side : view.sides) side[2] = 1;
  std::vector look{&baseline::look_at_eight};
  std::vector free_of{&baseline::free_voxels};
#if defined(__x86_64__)
  if (simd::available(simd::InstructionSet::avx2, simd::best())) {
    look.push_back(&avx2::look_at_eight);
    free_of.push_back(&avx2::free_voxels);
  }
  if (simd::available(simd::InstructionSet::avx512, simd::best())) {
    look.push_back(&avx512::look_at_eight);
    free_of.push_back(&avx512::free_voxels);
  }
#endif
  std::uint64_t any = 0;
  unsigned any_cube = 0, no_cube = 0;
  for (int i = 0; i < 3000; ++i) {
    std::array<double, 24> centres{};
    const Vector3d place(0.6 * unit(random), 0.4 * unit(random), 5.2 + 0.8 * unit(random));
    for (std::size_t k = 0; k < 24; ++k) {
      centres[k] = place[static_cast<int>(k / 8)] + 0.005 * unit(random);
      view.offsets[k] = 0.005 * unit(random);
    }
    const auto inside = static_cast<unsigned>(random() & 255U);
    const std::uint64_t free = free_of[0](view, centres.data(), ~std::uint64_t{0}, inside);
    any |= free != 0 && ~free != 0 ? 1U : 0U;
    EXPECT_EQ(free_of[0](view, centres.data(), 0x00ff00ff00ff00ffU, inside), free & 0x00ff00ff00ff00ffU);
    for (const auto& kernel : free_of)
      EXPECT_EQ(kernel(view, centres.data(), ~std::uint64_t{0}, inside), free);
    const Eighths cubes = look[0](view, centres.data(), 0.2, 255);
    EXPECT_EQ(cubes.free & cubes.nothing, 0U);
    any_cube |= cubes.free;
    no_cube |= cubes.nothing;
    for (const auto& kernel : look) {
      const Eighths same = kernel(view, centres.data(), 0.2, 0x5a);
      EXPECT_EQ(same.free, cubes.free & 0x5aU);
      EXPECT_EQ(same.nothing, cubes.nothing & 0x5aU);
      EXPECT_EQ(same.inside, cubes.inside & 0x5aU);
    }
  }
  EXPECT_EQ(any, 1U);
  EXPECT_EQ(any_cube, 255U);
  EXPECT_EQ(no_cube, 255U);
}

}  // namespace
}  // namespace pade::mapping
