#include "pade/io/formats/map_files.hpp"

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <memory>
#include <random>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <octomap/OcTree.h>

#include "pade/io/text.hpp"
#include "pade/mapping/tiles/voxel_code.hpp"

#include "mapping/flown_map.hpp"
#include "mapping/query/random_map.hpp"

namespace pade::io {
namespace {

using mapping::map_of;
using mapping::MapCell;
using mapping::MapOptions;
using mapping::Occupancy;
using mapping::OccupancyMap;

namespace fs = std::filesystem;
using Eigen::Vector3d;

const OccupancyMap& flown() {
  static const OccupancyMap map =
      map_of(*simulation::make_analytic_flight("forward", 3, simulation::analytic_camera(160, 120)), 0.01);
  return map;
}

class MapFile : public testing::TestWithParam<const char*> {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() / ("pade_map_files_" + std::to_string(std::random_device{}()));
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }
  [[nodiscard]] bool is_binary() const { return std::string(GetParam()) == "bt"; }
  [[nodiscard]] MapFormat format() const { return is_binary() ? MapFormat::bt : MapFormat::ot; }

  fs::path folder_;
};

/// Every leaf of the map has the same state in `tree`, and the other way round.
void expect_same_space(const OccupancyMap& map, const octomap::OcTree& tree) {
  std::size_t checked = 0;
  map.for_each([&](const MapCell& cell, Occupancy state) {
    const octomap::OcTreeNode* node = tree.search(octomap::OcTreeKey(cell.key[0], cell.key[1], cell.key[2]));
    ASSERT_NE(node, nullptr);
    ASSERT_EQ(tree.isNodeOccupied(node), state == Occupancy::occupied);
    ++checked;
  });
  EXPECT_GT(checked, 1000U);
  for (auto leaf = tree.begin_leafs(); leaf != tree.end_leafs(); ++leaf) {
    const Vector3d centre(leaf.getX(), leaf.getY(), leaf.getZ());
    ASSERT_EQ(map.at(centre - Vector3d::Constant(0.01)),
              tree.isNodeOccupied(*leaf) ? Occupancy::occupied : Occupancy::free);
  }
}

TEST_P(MapFile, IsReadByOctoMapItself) {
  const fs::path path = folder_ / (std::string("map.") + GetParam());
  ASSERT_TRUE(write_map(flown(), path, io::Overwrite::refuse).ok());
  std::unique_ptr<octomap::OcTree> tree;
  if (is_binary()) {
    tree = std::make_unique<octomap::OcTree>(0.5);
    ASSERT_TRUE(tree->readBinary(path.string()));
  } else {
    tree.reset(dynamic_cast<octomap::OcTree*>(octomap::AbstractOcTree::read(path.string())));
    ASSERT_TRUE(tree);
  }
  EXPECT_DOUBLE_EQ(tree->getResolution(), 0.1);
  expect_same_space(flown(), *tree);
}

TEST_P(MapFile, IsReadByTheToolsOfOctoMap) {
  if (std::system("command -v bt2vrml > /dev/null 2>&1") != 0)
    GTEST_SKIP() << "octomap-tools is not installed";
  const fs::path path = folder_ / (std::string("map.") + GetParam());
  ASSERT_TRUE(write_map(flown(), path, io::Overwrite::refuse).ok());
  const std::string tool = is_binary()
                               ? "bt2vrml " + path.string()
                               : "convert_octree " + path.string() + " " + (folder_ / "out.bt").string();
  ASSERT_EQ(std::system((tool + " > /dev/null 2>&1").c_str()), 0);
  const fs::path made = folder_ / (is_binary() ? "map.bt.wrl" : "out.bt");
  ASSERT_TRUE(fs::exists(made));
  EXPECT_GT(fs::file_size(made), 2000U);
}

TEST_P(MapFile, ReadsBackToTheSameSpaceAndTheSameBytes) {
  const std::string content = io::bytes_of(encode_map(flown(), format()));
  const auto map = decode_map(content, "map");
  ASSERT_TRUE(map.ok()) << map.error().message;
  expect_same_space(flown(), *map->octree());
  EXPECT_EQ(io::bytes_of(encode_map(*map, format())), content);
}

/// A .bt says free or occupied and no more: that is what is read from it, whatever the thresholds are.
TEST_P(MapFile, ReadsBackToTheSameSpaceWithAnyThreshold) {
  struct Limits {
    double clamp_min, threshold, clamp_max;
  };
  for (const Limits& limits : {Limits{0.03, 0.1, 0.9}, Limits{0.12, 0.35, 0.97}, Limits{0.12, 0.98, 0.99}}) {
    mapping::MapOptions options;
    options.clamp_min = limits.clamp_min;
    options.occupancy_threshold = limits.threshold;
    options.clamp_max = limits.clamp_max;
    auto tree = std::make_unique<octomap::OcTree>(0.1);
    tree->setClampingThresMin(limits.clamp_min);
    tree->setClampingThresMax(limits.clamp_max);
    const auto log_odds = [](double p) { return static_cast<float>(std::log(p / (1 - p))); };
    for (int i = 0; i < 200; ++i) {
      const double p = limits.clamp_min + (limits.clamp_max - limits.clamp_min) * i / 199;
      tree->setNodeValue(0.1 * i, 0.05, 0.05, log_odds(p));
    }
    const auto map = OccupancyMap::create(options, std::move(tree));
    ASSERT_TRUE(map.ok()) << map.error().message;
    ASSERT_GT(map->counts().occupied, 0U);
    ASSERT_GT(map->counts().free, 0U);
    const auto expect_same = [&](const std::string& bytes, const char* of) {
      const auto back = decode_map(bytes, "map", options);
      ASSERT_TRUE(back.ok()) << back.error().message;
      for (int i = -1; i < 201; ++i) {
        const Vector3d place(0.1 * i + 0.05, 0.05, 0.05);
        ASSERT_EQ(back->at(place), map->at(place)) << of << ' ' << limits.threshold << ' ' << i;
      }
    };
    expect_same(io::bytes_of(encode_map(*map, format())), "map");
    // The log-odds of a view are coarse; which side of the threshold they are on is not.
    const auto view = mapping::MapView::of(*map);
    expect_same(io::bytes_of(encode_map(*view, format())), "view");
  }
}

/// OctoMap makes a free cube of a node that has nothing below it, however large.
TEST(MapFileNodes, AnInnerNodeWithoutChildrenIsRefused) {
  const std::string header = "# Octomap OcTree binary file\nid OcTree\nsize 2\nres 0.1\ndata\n";
  const auto map = decode_map(header + std::string("\0\xc0\0\0", 4), "map.bt");
  ASSERT_FALSE(map.ok());
  EXPECT_NE(map.error().message.find("map.bt: an inner node has no child"), std::string::npos)
      << map.error().message;
}

/// The root of a .bt file has no state of its own: OctoMap takes one without children for occupied.
TEST_P(MapFile, OfASpaceThatIsTheSameAllOverReadsBackTheSame) {
  for (const float log_odds : {-1.0F, 2.0F}) {
    std::string content = "# Octomap OcTree file\nid OcTree\nsize 1\nres 0.1\ndata\n";
    content.append(reinterpret_cast<const char*>(&log_odds), sizeof log_odds).push_back('\0');
    const auto map = decode_map(content, "all.ot");
    ASSERT_TRUE(map.ok()) << map.error().message;
    const auto state = log_odds > 0 ? Occupancy::occupied : Occupancy::free;
    ASSERT_EQ(map->at(Vector3d(1, 2, 3)), state);
    for (const std::string& bytes : {bytes_of(encode_map(*map, format())),
                                     bytes_of(encode_map(*mapping::MapView::of(*map), format()))}) {
      const auto back = decode_map(bytes, "map");
      ASSERT_TRUE(back.ok()) << back.error().message;
      EXPECT_EQ(back->at(Vector3d(1, 2, 3)), state);
      EXPECT_EQ(back->at(Vector3d(-3000, 3000, -1)), state);
    }
  }
}

/// Other programs do not join voxels that are the same, and some write a log-odds of 0 as -0.
TEST_P(MapFile, IsTheSameHoweverTheSameSpaceIsDivided) {
  const auto bytes_with = [&](float zero, bool divided) {
    auto tree = std::make_unique<octomap::OcTree>(0.1);
    for (int i = 0; i < 16 * 16 * 16; ++i) {
      tree->setNodeValue(0.1 * (i % 16) + 0.05, 0.1 * (i / 16 % 16) + 0.05, 0.1 * (i / 256) + 0.05, -1.0F);
      tree->setNodeValue(0.1 * (i % 16) + 3.25, 0.1 * (i / 16 % 16) + 0.05, 0.1 * (i / 256) + 0.05,
                         i % 3 == 0 ? zero : 0.0F);
    }
    if (divided) tree->expand();
    const auto map = OccupancyMap::create({}, std::move(tree));
    EXPECT_TRUE(map.ok());
    return bytes_of(encode_map(*map, format()));
  };
  const std::string bytes = bytes_with(0.0F, false);
  EXPECT_EQ(bytes_with(0.0F, true), bytes);
  EXPECT_EQ(bytes_with(-0.0F, true), bytes);
}

/// A cube of 512 voxels to a side of which only an eighth is known takes the most memory for its bytes.
TEST(MapFileNodes, ASmallFileTakesLittleMemory) {
  std::string data;
  std::size_t nodes = 0;
  const std::function<void(int)> add = [&](int depth) {
    constexpr int kParts = 7, kAlone = 3;  // depths
    const unsigned children = depth == kParts ? 1 : depth < kAlone ? 3 : 0xffff;
    data += {static_cast<char>(children & 255U), static_cast<char>(children >> 8U)};
    ++nodes;
    if (depth == kParts) {
      ++nodes;  // its one free child
      return;
    }
    for (int i = 0; i < (depth < kAlone ? 1 : 8); ++i) add(depth + 1);
  };
  add(0);
  const std::string content =
      "# Octomap OcTree binary file\nid OcTree\nsize " + std::to_string(nodes) + "\nres 0.1\ndata\n" + data;
  const auto map = decode_map(content, "map.bt");
  ASSERT_TRUE(map.ok()) << map.error().message;
  EXPECT_EQ(map->counts().free, std::size_t{4096} * 256 * 256 * 256);
  EXPECT_LT(map->memory(), 2000 * content.size());
}

TEST(MapFileNodes, ATreeWithoutEndIsRefused) {
  std::string content = "# Octomap OcTree binary file\nid OcTree\nsize 1000000\nres 0.1\ndata\n";
  for (int i = 0; i < 1000000; ++i) content += std::string("\x03\0", 2);
  const auto map = decode_map(content, "map.bt");
  ASSERT_FALSE(map.ok());
  EXPECT_NE(map.error().message.find("map.bt: the tree is deeper than 16 levels"), std::string::npos)
      << map.error().message;
}

/// They come from the writer, and so are written again as they are.
TEST(MapFileNodes, TheSeedsOfTheFuzzTargetAreMaps) {
  for (const char* name : {"small.bt", "small.ot"}) {
    const fs::path file = fs::path(PADE_SOURCE_DIR) / "tests/fuzz/corpus/map" / name;
    const auto content = read_file(file);
    ASSERT_TRUE(content.ok()) << content.error().message;
    const auto map = decode_map(*content, name);
    ASSERT_TRUE(map.ok()) << map.error().message;
    EXPECT_GT(map->counts().free, 0U);
    EXPECT_GT(map->counts().occupied, 0U);
    EXPECT_EQ(bytes_of(encode_map(*map, file.extension() == ".bt" ? MapFormat::bt : MapFormat::ot)),
              *content);
  }
}

/// What a live session saves meanwhile, from the picture that others may read.
TEST_P(MapFile, OfAViewIsThatOfItsMap) {
  std::vector<OccupancyMap> maps;
  for (std::uint64_t seed = 1; seed <= 3; ++seed) maps.push_back(mapping::random_map(seed));
  maps.push_back(std::move(OccupancyMap::create()).value());
  const auto check = [&](const OccupancyMap& map) {
    const auto view = mapping::MapView::of(map);
    const std::string bytes = bytes_of(encode_map(*view, format()));
    if (is_binary()) {
      EXPECT_EQ(bytes, bytes_of(encode_map(map, format())));
      return;
    }
    const auto back = decode_map(bytes, "map.ot");
    ASSERT_TRUE(back.ok()) << back.error().message;
    map.for_each_leaf([&](const mapping::MapLeaf& leaf) {
      const Vector3d centre =
          mapping::cell_of(leaf.code, leaf.depth, map.options().voxel).centre.cast<double>();
      const Vector3d place = centre - Vector3d::Constant(0.01);
      ASSERT_EQ(back->at(place), map.at(place));
      ASSERT_NEAR(back->probability(place), map.probability(place), 0.005);
    });
  };
  check(flown());
  for (const OccupancyMap& map : maps) check(map);
}

TEST_P(MapFile, OfAnEmptyMapReadsBackEmpty) {
  const OccupancyMap empty = std::move(OccupancyMap::create()).value();
  const auto map = decode_map(io::bytes_of(encode_map(empty, format())), "map");
  ASSERT_TRUE(map.ok()) << map.error().message;
  EXPECT_EQ(map->counts().free + map->counts().occupied, 0U);
}

TEST_P(MapFile, CutShortAnywhereIsAnErrorAndNeverPartOfAMap) {
  const std::string content = io::bytes_of(encode_map(flown(), format()));
  std::mt19937 random(1);
  std::uniform_int_distribution<std::size_t> where(0, content.size() - 1);
  for (int i = 0; i < 300; ++i) {
    const auto map =
        decode_map(content.substr(0, i < 150 ? static_cast<std::size_t>(i) : where(random)), "map");
    ASSERT_FALSE(map.ok());
    EXPECT_EQ(map.error().message.rfind("map: ", 0), 0U) << map.error().message;
  }
  EXPECT_FALSE(decode_map(content + "x", "map").ok());
}

TEST_P(MapFile, WithChangedBytesIsAnErrorOrAMapButNeverACrash) {
  const std::string content = io::bytes_of(encode_map(flown(), format()));
  std::mt19937 random(2);
  std::uniform_int_distribution<std::size_t> where(0, content.size() - 1);
  std::uniform_int_distribution<int> byte(0, 255);
  for (int i = 0; i < 60; ++i) {
    std::string changed = content;
    changed[where(random)] = static_cast<char>(byte(random));
    const auto map = decode_map(changed, "map");
    if (map.ok()) {
      EXPECT_GT(map->counts().free, 0U);
    }
  }
}

TEST_P(MapFile, ThatCannotBeWrittenIsAnError) {
  const std::string name = std::string("map.") + GetParam();
  const Status nowhere = write_map(flown(), folder_ / "missing" / name, io::Overwrite::refuse);
  ASSERT_FALSE(nowhere.ok());
  EXPECT_NE(nowhere.error().message.find(name), std::string::npos);
  ASSERT_TRUE(write_map(flown(), folder_ / name, io::Overwrite::refuse).ok());
  EXPECT_FALSE(write_map(flown(), folder_ / name, io::Overwrite::refuse).ok());
  EXPECT_TRUE(write_map(flown(), folder_ / name, io::Overwrite::replace).ok());
  EXPECT_FALSE(write_map(flown(), folder_ / "map.txt", io::Overwrite::refuse).ok());
}

INSTANTIATE_TEST_SUITE_P(Formats, MapFile, testing::Values("bt", "ot"),
                         [](const auto& format) { return std::string(format.param); });

TEST(SideCar, CarriesTheGeographicOriginWhereItIsKnown) {
  const io::GeographicOrigin origin{47.397742, 8.545594, 488.25};
  const auto with = decode_side_car(encode_side_car({}, origin), "map.json");
  ASSERT_TRUE(with.ok()) << with.error().message;
  EXPECT_EQ(**with, origin);
  const auto without = decode_side_car(encode_side_car({}, std::nullopt), "map.json");
  ASSERT_TRUE(without.ok());
  EXPECT_FALSE(without->has_value());
  EXPECT_FALSE(decode_side_car("nonsense", "map.json").ok());
  EXPECT_FALSE(decode_side_car(R"({"geographic_origin": {"latitude_deg": 1}})", "map.json").ok());
  EXPECT_EQ(side_car_of("run/map.bt"), fs::path("run/map.json"));
}

}  // namespace
}  // namespace pade::io
