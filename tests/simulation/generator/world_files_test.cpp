// Worlds from seeds: their bytes, and their files in one folder.
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pade/core/fingerprint.hpp"
#include "pade/simulation/generator/open_world.hpp"
#include "pade/simulation/generator/world_generator.hpp"
#include "pade/simulation/sdf/sdf_reader.hpp"
#include "pade/simulation/world/world_fingerprint.hpp"

#include "support/temporary_folder.hpp"

namespace pade::simulation {
namespace {

namespace fs = std::filesystem;

std::string shown_by(const fs::path& file) {
  const auto world = read_sdf(file);
  EXPECT_TRUE(world.ok()) << file << ": " << (world.ok() ? "" : world.error().message);
  return world.ok() ? world_fingerprint(*world) : "unreadable";
}

std::string bytes_of(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  std::ostringstream bytes;
  bytes << stream.rdbuf();
  return bytes.str();
}

/// Worlds of several kinds and seeds, all with trees or stones.
std::map<std::string, WorldFiles> worlds_by_file() {
  std::map<std::string, WorldFiles> worlds;
  for (const WorldKind kind : {WorldKind::forest, WorldKind::building, WorldKind::rubble}) {
    for (const std::uint64_t seed : {1, 2})
      worlds[std::string(to_name(kind)) + std::to_string(seed) + ".sdf"] = generate_world(kind, seed);
  }
  worlds["rubble & stones.sdf"] = generate_open_world(OpenWorldKind::rubble, 3, 50).files;
  worlds["forest1.world"] = generate_open_world(OpenWorldKind::forest, 3, 50).files;
  return worlds;
}

/// A world file without its meshes, and the content of the mesh behind each URI in order.
template <class Content>
std::pair<std::string, std::vector<std::string>> taken_apart(std::string sdf, const Content& content) {
  std::vector<std::string> meshes;
  const std::string before = "<uri>meshes/";
  for (std::size_t at = sdf.find(before); at != std::string::npos; at = sdf.find(before, at)) {
    at += before.size();
    const std::size_t length = sdf.find('<', at) - at;
    meshes.push_back(content(sdf.substr(at, length)));
    sdf.erase(at, length);
  }
  return {std::move(sdf), std::move(meshes)};
}

std::string fingerprint_of(const WorldFiles& files) {
  Fingerprint all;
  all.text(files.sdf);
  for (const auto& [name, content] : files.meshes) {
    all.text(name);
    all.text(content);
  }
  return all.hex();
}

/// No property tells that a seed makes the world that it always made: hence stored numbers. They are the same
/// for each compiler, whatever it does with what the language leaves open.
TEST(WorldsFromSeeds, AreTheSameToTheByteAsEver) {
  std::map<std::string, std::string> made;
  for (const auto& [kind, name] : EnumNames<WorldKind>::names)
    made[std::string(name)] = fingerprint_of(generate_world(kind, 5));
  for (const auto& [kind, name] : EnumNames<OpenWorldKind>::names)
    made["open " + std::string(name)] = fingerprint_of(generate_open_world(kind, 5, 400).files);
  const std::map<std::string, std::string> expected = {
      {"building", "5068c8e64fe0d584"},    {"corridor", "57962e1f6f8b531c"},
      {"forest", "5340d5d63b69f927"},      {"open building-site", "59f4b7815f24cdcd"},
      {"open forest", "6a4dc675becc2aff"}, {"open rubble", "00c7b1818c5488f7"},
      {"open street", "d44ee7c0f3b21105"}, {"rubble", "8dbfdea8980b6e41"},
      {"street", "1d0fc16aaa88a934"},
  };
  EXPECT_EQ(made, expected);
}

/// "--" has no place in a comment of XML.
TEST(WorldsFromSeeds, AreWellFormedToTheirComments) {
  const auto remark_of = [](const std::string& sdf) {
    const auto begin = sdf.find("<!--") + 4;
    return sdf.substr(begin, sdf.find("-->") - begin);
  };
  for (const auto& [kind, name] : EnumNames<WorldKind>::names)
    EXPECT_EQ(remark_of(generate_world(kind, 5).sdf).find("--"), std::string::npos) << name;
  for (const auto& [kind, name] : EnumNames<OpenWorldKind>::names)
    EXPECT_EQ(remark_of(generate_open_world(kind, 5, 400).files.sdf).find("--"), std::string::npos) << name;
}

TEST(WorldFilesInOneFolder, EachShowTheirOwnWorld) {
  const test::TemporaryFolder together;
  const auto worlds = worlds_by_file();
  for (const auto& [name, files] : worlds) {
    const fs::path file = together.path() / name;
    ASSERT_TRUE(write_world(with_own_meshes(files, file), file, io::Overwrite::refuse).ok()) << name;
  }
  for (const auto& [name, files] : worlds) {
    const auto& meshes = files.meshes;
    const auto made = taken_apart(files.sdf, [&](const std::string& mesh) { return meshes.at(mesh); });
    const auto read = taken_apart(bytes_of(together.path() / name), [&](const std::string& mesh) {
      return bytes_of(together.path() / "meshes" / mesh);
    });
    EXPECT_GT(made.second.size(), 10U) << name;
    EXPECT_EQ(read.first, made.first) << name;
    EXPECT_TRUE(read.second == made.second) << name;
  }
  // The reader finds them, whatever the name of the world.
  const std::string name = "rubble & stones.sdf";
  const test::TemporaryFolder alone;
  ASSERT_TRUE(write_world(worlds.at(name), alone.path() / "world.sdf").ok());
  EXPECT_EQ(shown_by(together.path() / name), shown_by(alone.path() / "world.sdf"));
}

TEST(WorldFilesInOneFolder, AreNotWrittenOverWhatSomebodyChanged) {
  const test::TemporaryFolder folder;
  const fs::path file = folder.path() / "forest.sdf";
  const WorldFiles made = with_own_meshes(generate_world(WorldKind::forest, 1), file);
  ASSERT_FALSE(made.meshes.empty());
  const auto write = [&](io::Overwrite overwrite) { return write_world(made, file, overwrite); };
  ASSERT_TRUE(write(io::Overwrite::refuse).ok());
  EXPECT_TRUE(write(io::Overwrite::refuse).ok()) << "the same content again is no other world";
  for (const fs::path& changed : {file, folder.path() / "meshes" / made.meshes.rbegin()->first}) {
    const std::string before = bytes_of(changed);
    std::ofstream(changed, std::ios::app) << "\n# by hand\n";
    const fs::path missing = folder.path() / "meshes" / made.meshes.begin()->first;
    fs::remove(missing);
    const Status refused = write(io::Overwrite::refuse);
    ASSERT_FALSE(refused.ok());
    EXPECT_THAT(refused.error().message,
                testing::AllOf(testing::HasSubstr(changed.string()), testing::HasSubstr("--force")));
    EXPECT_FALSE(fs::exists(missing)) << "nothing is written where something is refused";
    ASSERT_TRUE(write(io::Overwrite::replace).ok());
    EXPECT_EQ(bytes_of(changed), before);
  }
}

}  // namespace
}  // namespace pade::simulation
