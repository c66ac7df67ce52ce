// What a page holds of a map, read back by the plainest means, is the map.
#include "pade/report/view_3d/view_3d.hpp"

#include <array>
#include <memory>
#include <random>
#include <set>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <octomap/OcTree.h>

#include "pade/mapping/query/map_view.hpp"
#include "pade/report/report_pictures.hpp"

#include "evaluation/map/known_map.hpp"

namespace pade::evaluation {
namespace {
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

using Key = std::array<unsigned, 3>;

/// Two thousand voxels here and there to both sides of the origin, and a cube of 8 to a side, which is one
/// leaf.
mapping::OccupancyMap scattered_map() {
  auto tree = std::make_unique<octomap::OcTree>(0.1);
  std::mt19937 random(7);
  std::uniform_real_distribution<double> place(-40, 40);
  for (int i = 0; i < 2000; ++i) {
    const Eigen::Vector3d at(place(random), place(random), place(random) / 8);
    test::fill(*tree, at, at, i % 5 != 0);
  }
  test::fill(*tree, {0.05, 0.05, 0.05}, {0.75, 0.75, 0.75}, true);
  tree->updateInnerOccupancy();
  tree->prune();
  return std::move(mapping::OccupancyMap::create({}, std::move(tree))).value();
}

/// Of the voxels, without their lowest bits.
std::set<Key> keys_of(const mapping::OccupancyMap& map, unsigned without = 0) {
  std::set<Key> keys;
  for (const mapping::MapCell& cell : map.occupied()) {
    const unsigned side = 1U << (mapping::kTreeDepth - cell.depth);
    for (unsigned i = 0; i < side * side * side; ++i)
      keys.insert({(cell.key[0] + i % side) >> without, (cell.key[1] + i / side % side) >> without,
                   (cell.key[2] + i / (side * side)) >> without});
  }
  return keys;
}

View3d view_of(const mapping::OccupancyMap& map, std::size_t most = 300'000) {
  View3d view;
  view.leaves = [&map](const auto& visitor) { map.for_each_leaf(visitor); };
  view.voxel = map.options().voxel;
  view.most_cubes = most;
  return view;
}

/// What the script reads.
nlohmann::json data_of(const std::string& html) {
  const std::string mark = "<script type=\"application/json\">";
  const std::size_t at = html.find(mark) + mark.size();
  return nlohmann::json::parse(html.substr(at, html.find("</script>", at) - at));
}

/// Byte by byte and bit by bit.
std::set<Key> decoded(const nlohmann::json& data) {
  std::set<Key> keys;
  std::uint64_t code = 0;
  std::uint64_t step = 0;
  unsigned bits = 0;
  std::size_t cubes = 0;
  for (const char byte : bytes_of_uri(";base64," + data["keys"].get<std::string>())) {
    step |= std::uint64_t{static_cast<unsigned char>(byte) & 127U} << bits;
    bits += 7;
    if ((static_cast<unsigned char>(byte) & 128U) != 0) continue;
    code += step;
    step = bits = 0;
    Key key{};
    for (unsigned bit = 0; bit < 48; ++bit)
      key[bit % 3] |= static_cast<unsigned>(code >> bit & 1U) << bit / 3;
    keys.insert(key);
    ++cubes;
  }
  EXPECT_EQ(cubes, data["cubes"]);
  return keys;
}

TEST(View3d, HoldsTheVoxelsOfTheMap) {
  const mapping::OccupancyMap map = scattered_map();
  const auto data = data_of(view_3d(view_of(map)));
  EXPECT_EQ(decoded(data), keys_of(map));
  EXPECT_EQ(data["cubes"], map.counts().occupied);
  EXPECT_EQ(data["side"], 0.1);
  EXPECT_EQ(data["zero"], 32768);
}

TEST(View3d, OfAViewOfTheMapHoldsTheSame) {
  const mapping::OccupancyMap map = scattered_map();
  const auto constant = mapping::MapView::of(map);
  View3d view = view_of(map);
  view.leaves = [&](const auto& visitor) { constant->for_each_leaf(visitor); };
  EXPECT_EQ(data_of(view_3d(view))["keys"], data_of(view_3d(view_of(map)))["keys"]);
}

TEST(View3d, LargeMapsAreShownInCubesAndSaySo) {
  const mapping::OccupancyMap map = scattered_map();
  const std::size_t all = map.counts().occupied;
  EXPECT_EQ(data_of(view_3d(view_of(map, all)))["side"], 0.1);
  for (const std::size_t most : {all - 1, all / 2, std::size_t{20}, std::size_t{1}}) {
    const auto data = data_of(view_3d(view_of(map, most)));
    EXPECT_LE(data["cubes"], most);
    const auto doublings = static_cast<unsigned>(std::lround(std::log2(data["side"].get<double>() / 0.1)));
    EXPECT_EQ(decoded(data), keys_of(map, doublings));
    EXPECT_GT(keys_of(map, doublings - 1).size(), most) << "no coarser than it must be";
    EXPECT_EQ(data["zero"].get<double>() * data["side"].get<double>(), 3276.8);
    EXPECT_THAT(data["says"].get<std::string>(), HasSubstr("drawn as"));
  }
}

/// A file can hold a block of rock of a hundred metres to each side.
TEST(VoxelList, StaysSmallHoweverLargeACube) {
  const VoxelList list = list_voxels(
      [](const auto& visitor) {
        visitor({0, 4, 1, true});
        visitor({std::uint64_t{1} << 36, 6, 1, true});
        visitor({std::uint64_t{1} << 37, 16, -1, false});
      },
      1000);
  EXPECT_EQ(list.voxels, (std::uint64_t{1} << 36) + (std::uint64_t{1} << 30));
  EXPECT_LE(list.codes.size(), 1000U);
  EXPECT_GT(list.codes.size(), 1000U / 8);
}

TEST(View3d, SaysThatNothingIsThere) {
  const auto empty = std::move(mapping::OccupancyMap::create({})).value();
  const auto data = data_of(view_3d(view_of(empty)));
  EXPECT_EQ(data["says"], "Nothing is occupied in this map.");
  EXPECT_EQ(data["cubes"], 0);
  View3d way;
  way.way = {{1, 2, 3}};
  EXPECT_EQ(data_of(view_3d(way))["says"], "There is no map.");
  EXPECT_EQ(view_3d({}), "");
}

TEST(View3d, ShowsWaysAlongItsAxes) {
  const auto map = test::free_lane(8);
  View3d view = view_of(map);
  view.up = -Eigen::Vector3d::UnitY();  // as in KITTI
  for (int i = 0; i <= 50'000; ++i) view.way.emplace_back(1e-3 * i, -2, 5);
  view.plan = {{0, 0, 0}, {1.23456, 0, 0}};
  const std::string html = view_3d(view);
  const auto data = data_of(html);
  const auto points = data["ways"]["way of the vehicle"]["points"].get<std::vector<double>>();
  ASSERT_EQ(points.size(), 3 * 2000U) << "however long";
  EXPECT_THAT(std::vector<double>(points.begin(), points.begin() + 3), testing::ElementsAre(0, 5, 2));
  EXPECT_THAT(std::vector<double>(points.end() - 3, points.end()), testing::ElementsAre(50, 5, 2));
  EXPECT_EQ(data["ways"]["planned path"]["points"][3], 1.235);
  EXPECT_THAT(data["names"], testing::ElementsAre("x", "z", "−y"));
  EXPECT_FALSE(data["north"]);
  EXPECT_THAT(html, AllOf(HasSubstr("way of the vehicle</span>"), HasSubstr("planned path</span>")));
  view.plan.clear();
  view.up = Eigen::Vector3d::UnitZ();
  view.is_enu = true;
  EXPECT_THAT(data_of(view_3d(view))["names"], testing::ElementsAre("x (east)", "y (north)", "z (up)"));
  EXPECT_THAT(view_3d(view), Not(HasSubstr("planned path")));
}

TEST(View3d, NeedsNothingFromOutside) {
  const std::string page = view_3d(view_of(test::free_lane(8))) + std::string(view_3d_script());
  EXPECT_THAT(page, AllOf(Not(HasSubstr("src=")), Not(HasSubstr("http:")), Not(HasSubstr("https:")),
                          Not(HasSubstr("fetch(")), Not(HasSubstr("import ")), Not(HasSubstr("url("))));
  EXPECT_THAT(std::string(view_3d_script()), Not(HasSubstr("</"))) << "it would end its element";
}

}  // namespace
}  // namespace pade::evaluation
