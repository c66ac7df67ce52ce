// What is packed is the same to the last bit: whatever comes between packing and asking.
#include <algorithm>
#include <map>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "pade/mapping/query/map_view.hpp"
#include "pade/mapping/tiles/voxel_store.hpp"

#include "mapping/flown_map.hpp"

namespace pade::mapping {
namespace {

struct KeptLeaf {
  std::uint64_t code;
  unsigned depth;
  float log_odds;
  bool operator==(const KeptLeaf&) const = default;
};

std::vector<KeptLeaf> leaves(const VoxelStore& store) {
  std::vector<KeptLeaf> all;
  store.for_each([&](std::uint64_t code, unsigned depth, float value) {
    all.push_back({code, depth, value});
  });
  return all;
}

constexpr int kExtent = 200;  // voxels, about the centre

/// Updates as images bring them, drawn about a place: tiles and larger cubes that are free, voxels that are
/// hit.
class DrawnUpdates {
 public:
  explicit DrawnUpdates(std::uint64_t seed) : random_(seed) {}

  void next(std::vector<FreeCube>& free, std::vector<VoxelHit>& hits) {
    std::map<std::uint64_t, FreeCube> cubes;
    std::map<std::uint64_t, float> struck;
    for (int i = 0; i < 40; ++i) {
      FreeCube cube;
      cube.code = morton_code(place()) & ~(voxels_of(kTileDepth) - 1);
      for (std::uint64_t& word : cube.voxels)
        word = drawn(3) == 0 ? ~std::uint64_t{0} : random_() & random_();
      cubes[cube.code] = cube;
    }
    if (drawn(4) == 0) {  // 16 voxels to a side, in place of the tiles in it
      const std::uint64_t code = morton_code(place()) & ~(voxels_of(kTileDepth - 1) - 1);
      for (std::uint64_t part = 0; part < 8; ++part) cubes.erase(code + part * voxels_of(kTileDepth));
      cubes[code] = {code, kTileDepth - 1, {}};
    }
    for (int i = 0; i < 60; ++i) {
      const std::uint64_t code = morton_code(place());
      if (cubes.contains(code & ~(voxels_of(kTileDepth - 1) - 1)) &&
          cubes[code & ~(voxels_of(kTileDepth - 1) - 1)].depth < kTileDepth)
        continue;
      struck[code] = 0.01F * static_cast<float>(1 + drawn(60));
    }
    free.clear();
    hits.clear();
    for (auto& [code, cube] : cubes) free.push_back(cube);
    for (const auto& [code, change] : struck) {
      hits.push_back({code, change});
      const auto cube = std::find_if(free.begin(), free.end(), [&, at = code](const FreeCube& f) {
        return f.depth == kTileDepth && f.code == (at & ~(voxels_of(kTileDepth) - 1));
      });
      if (cube != free.end()) cube->voxels[code >> 6U & 7U] &= ~(std::uint64_t{1} << (code & 63U));
    }
  }
  VoxelKey place() {
    VoxelKey key;
    for (auto& axis : key) axis = static_cast<std::uint16_t>(kTreeCentre - kExtent / 2 + drawn(kExtent));
    return key;
  }
  int drawn(int below) { return static_cast<int>(random_() % static_cast<unsigned>(below)); }

 private:
  std::mt19937_64 random_;
};

class Packing : public testing::TestWithParam<std::uint64_t> {};

TEST_P(Packing, ChangesNothingThatIsSeenOrWritten) {
  const MapOptions options;
  VoxelStore plain(LogOdds(options), options.voxel);
  VoxelStore packing(LogOdds(options), options.voxel);
  DrawnUpdates draw(GetParam());
  std::vector<FreeCube> free;
  std::vector<VoxelHit> hits;
  for (int round = 0; round < 24; ++round) {
    draw.next(free, hits);
    MapChange change;
    MapChange same;
    plain.apply(free, hits, change);
    packing.apply(free, hits, same);
    ASSERT_EQ(change.touched.size(), same.touched.size());
    ASSERT_EQ(change.became_free.size(), same.became_free.size());
    ASSERT_EQ(change.became_occupied.size(), same.became_occupied.size());
    if (draw.drawn(3) == 0) {
      const std::uint64_t tile = morton_code(draw.place()) & ~(voxels_of(kTileDepth) - 1);
      std::array<std::uint64_t, 8> all{};
      all.fill(~std::uint64_t{0});
      plain.forget_free(tile, all, change);
      packing.forget_free(tile, all, same);
    }
    packing.pack_beyond(draw.place(), draw.drawn(120));
    for (int i = 0; i < 20; ++i) {
      const std::uint64_t code = morton_code(draw.place());
      float a = 0;
      float b = 0;
      ASSERT_EQ(plain.value_at(code, a), packing.value_at(code, b));
      ASSERT_EQ(a, b);
      const std::uint64_t cube = code & ~(voxels_of(10) - 1);
      ASSERT_EQ(plain.count_least(cube, 10), packing.count_least(cube, 10));
    }
    if (round % 6 == 5) {
      ASSERT_EQ(leaves(plain), leaves(packing));
    }
  }
  packing.pack_beyond({0, 0, 0}, 1);
  EXPECT_EQ(leaves(plain), leaves(packing));
  EXPECT_GT(packing.packed_memory(), 0U);
  EXPECT_EQ(plain.packed_memory(), 0U);
}

INSTANTIATE_TEST_SUITE_P(Seeds, Packing, testing::Range<std::uint64_t>(1, 4));

/// A flight past a scene, there and back, whose images are mapped with what is far packed and without.
TEST(PackedMap, IsTheMapAndMuchSmaller) {
  const auto flight =
      *simulation::make_analytic_flight("courtyard", 4, simulation::analytic_camera(160, 120));
  MapOptions options;
  OccupancyMap plain = std::move(OccupancyMap::create(options)).value();
  options.pack_beyond = 1;
  OccupancyMap packing = std::move(OccupancyMap::create(options)).value();
  // The same scene again and again, ever farther: the content of each place is known from the first.
  constexpr int kPlaces = 5;
  for (int leg = 0; leg < 2 * kPlaces - 1; ++leg) {
    const int place = leg < kPlaces ? leg : 2 * kPlaces - 2 - leg;
    for (std::size_t k = 0; k < flight.times.size(); ++k) {
      Pose T = flight.T_world_camera[k];
      T.translation += Eigen::Vector3d(0, 64 * place, 0);
      const DepthImage image = depth_image(flight, k, 0.01);
      const MapChange a = plain.integrate(image, flight.camera, T);
      const MapChange b = packing.integrate(image, flight.camera, T);
      ASSERT_EQ(a.hits, b.hits);
      ASSERT_EQ(a.pending_free, b.pending_free);
      ASSERT_EQ(a.became_free.size(), b.became_free.size());
    }
  }
  std::vector<MapLeaf> expected;
  plain.for_each_leaf([&](const MapLeaf& leaf) { expected.push_back(leaf); });
  std::size_t at = 0;
  packing.for_each_leaf([&](const MapLeaf& leaf) {
    ASSERT_LT(at, expected.size());
    EXPECT_TRUE(leaf.code == expected[at].code && leaf.depth == expected[at].depth &&
                leaf.log_odds == expected[at].log_odds);
    ++at;
  });
  EXPECT_EQ(at, expected.size());
  EXPECT_GT(expected.size(), 10000U);
  RecordProperty("plain_MB", std::to_string(1e-6 * static_cast<double>(plain.memory())));
  RecordProperty("packing_MB", std::to_string(1e-6 * static_cast<double>(packing.memory())));
  EXPECT_LT(static_cast<double>(packing.memory()), 0.6 * static_cast<double>(plain.memory()));

  // For a view of a small place no more is unpacked than lies there.
  const std::size_t before = packing.voxels().packed_memory();
  const Eigen::Vector3d there =
      flight.T_world_camera[0].translation + Eigen::Vector3d(0, 64 * (kPlaces - 1), 0);
  MapView::of(packing, {there.array() - 0.01, there.array() + 0.01});
  EXPECT_GT(static_cast<double>(packing.voxels().packed_memory()), 0.9 * static_cast<double>(before));

  // A view whose window slides away and back: what it says of each place is the same each time.
  const auto leaves_of_view = [](const MapView& view) {
    std::vector<KeptLeaf> all;
    view.for_each_leaf([&](const MapLeaf& leaf) { all.push_back({leaf.code, leaf.depth, leaf.log_odds}); });
    return all;
  };
  std::vector<std::vector<KeptLeaf>> seen;
  for (int leg = 0; leg < 2 * kPlaces - 1; ++leg) {
    const int place = leg < kPlaces ? leg : 2 * kPlaces - 2 - leg;
    const Eigen::Vector3d middle = flight.T_world_camera[0].translation + Eigen::Vector3d(0, 64 * place, 0);
    const Eigen::AlignedBox3d window(middle.array() - 15, middle.array() + 15);
    seen.push_back(leaves_of_view(*MapView::of(packing, window)));
    EXPECT_EQ(seen.back(), leaves_of_view(*MapView::of(plain, window)));
    if (leg >= kPlaces) {
      EXPECT_EQ(seen.back(), seen[static_cast<std::size_t>(place)]);
    }
    EXPECT_GT(seen.back().size(), 1000U);
  }
}

}  // namespace
}  // namespace pade::mapping
