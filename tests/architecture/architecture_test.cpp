// Holds the sources to the rules of docs/design.md that a program can check.
#include <algorithm>
#include <filesystem>
#include <map>
#include <regex>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "architecture/includes.hpp"

namespace pade::architecture {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::IsEmpty;

const fs::path kRoot = PADE_SOURCE_DIR;

std::string shown(const fs::path& file) { return file.lexically_relative(kRoot).generic_string(); }

std::vector<fs::path> all_sources() {
  std::vector<fs::path> files = sources_under(kRoot / "src");
  const std::vector<fs::path> apps = sources_under(kRoot / "apps");
  files.insert(files.end(), apps.begin(), apps.end());
  return files;
}

std::vector<fs::path> all_headers() {
  std::vector<fs::path> files = all_sources();
  std::erase_if(files, [](const fs::path& file) { return file.extension() != ".hpp"; });
  return files;
}

/// "file:line: text" of each line of the code (comments and strings apart) that matches.
std::vector<std::string> lines_with(const fs::path& file, const std::regex& pattern) {
  std::vector<std::string> found;
  const std::string code = without_comments_and_strings(read(file));
  for (std::sregex_iterator match(code.begin(), code.end(), pattern), end; match != end; ++match) {
    const auto line = 1 + std::count(code.begin(), code.begin() + match->position(), '\n');
    found.push_back(shown(file) + ":" + std::to_string(line) + ": " + match->str());
  }
  return found;
}

TEST(Architecture, EveryRoomHasARowInTheDesign) {
  const Rules rules = rules_of(read(kRoot / "docs" / "design.md"));
  std::vector<std::string> without_row;
  for (const auto& entry : fs::directory_iterator(kRoot / "src" / "pade")) {
    const std::string room = entry.path().filename();
    if (entry.is_directory() && !rules.contains(room)) without_row.push_back(room);
  }
  EXPECT_THAT(without_row, IsEmpty());
  EXPECT_GE(rules.size(), 9U);
}

TEST(Architecture, ARoomIncludesOnlyWhatTheDesignAllows) {
  const Rules rules = rules_of(read(kRoot / "docs" / "design.md"));
  std::vector<std::string> broken;
  int includes = 0;
  for (const fs::path& file : sources_under(kRoot / "src" / "pade")) {
    const std::string room = file.lexically_relative(kRoot / "src" / "pade").begin()->string();
    if (room == "pade.hpp") continue;  // of all rooms
    for (const std::string& header : pade_includes(read(file))) {
      ++includes;
      if (!allowed(rules, room, header)) broken.push_back(shown(file) + " includes pade/" + header);
    }
  }
  EXPECT_THAT(broken, IsEmpty());
  EXPECT_GT(includes, 50) << "the sources were not found";
}

TEST(Architecture, EveryPermissionInTheDesignIsUsed) {
  Rules unused = rules_of(read(kRoot / "docs" / "design.md"));
  for (const fs::path& file : sources_under(kRoot / "src" / "pade")) {
    const std::string room = file.lexically_relative(kRoot / "src" / "pade").begin()->string();
    for (const std::string& header : pade_includes(read(file))) {
      unused[room].erase(header);
      unused[room].erase(header.substr(0, header.find('/')));
    }
  }
  std::vector<std::string> permissions;
  for (const auto& [room, headers] : unused) {
    for (const std::string& header : headers) permissions.push_back(room + " may include " + header);
  }
  EXPECT_THAT(permissions, IsEmpty());
}

TEST(Architecture, AFolderHasAtMost20Files) {
  std::map<std::string, int> files;
  for (const char* tree : {"src", "apps", "tests", "benchmarks"}) {
    for (const fs::path& file : sources_under(kRoot / tree)) ++files[shown(file.parent_path())];
  }
  std::vector<std::string> crowded;
  for (const auto& [folder, count] : files) {
    if (count > 20) crowded.push_back(folder + ": " + std::to_string(count));
  }
  EXPECT_THAT(crowded, IsEmpty());
  EXPECT_GT(files.size(), 20U) << "the folders were not found";
}

TEST(Architecture, RoomsDoNotDependOnEachOtherInACircle) {
  // Rooms without unvisited dependencies are taken away until none is left.
  Rules rules = rules_of(read(kRoot / "docs" / "design.md"));
  for (bool progress = true; progress;) {
    progress = false;
    for (auto room = rules.begin(); room != rules.end();) {
      const bool free = std::none_of(room->second.begin(), room->second.end(), [&](const std::string& name) {
        return rules.contains(name.substr(0, name.find('/')));
      });
      progress = progress || free;
      room = free ? rules.erase(room) : std::next(room);
    }
  }
  EXPECT_THAT(rules, IsEmpty());
}

TEST(Architecture, AFileIsOneThingAndFitsInto500Lines) {
  std::vector<std::string> long_files;
  for (const fs::path& file : all_sources()) {
    const std::string text = read(file);
    const auto lines = std::count(text.begin(), text.end(), '\n');
    if (lines > 500) long_files.push_back(shown(file) + ": " + std::to_string(lines));
  }
  EXPECT_THAT(long_files, IsEmpty());
}

TEST(Architecture, HeadersGuardThemselves) {
  std::vector<std::string> unguarded;
  for (const fs::path& file : all_headers()) {
    if (read(file).find("\n#pragma once\n") == std::string::npos) unguarded.push_back(shown(file));
  }
  EXPECT_THAT(unguarded, IsEmpty());
}

TEST(Architecture, HeadersOpenNoNamespaceForTheirUsers) {
  // At the start of a line: file or namespace scope, since bodies are indented.
  static const std::regex kOpened(R"((^|\n)using namespace [^;]*)");
  std::vector<std::string> found;
  for (const fs::path& file : all_headers()) {
    const auto lines = lines_with(file, kOpened);
    found.insert(found.end(), lines.begin(), lines.end());
  }
  EXPECT_THAT(found, IsEmpty());
}

TEST(Architecture, ErrorsAreValuesAndNothingIsThrown) {
  static const std::regex kThrow(R"(\bthrow\b[^;]*)");
  std::vector<std::string> found;
  for (const fs::path& file : all_sources()) {
    const auto lines = lines_with(file, kThrow);
    found.insert(found.end(), lines.begin(), lines.end());
  }
  EXPECT_THAT(found, IsEmpty());
}

// The reader itself: a check that sees nothing would pass for ever.

TEST(ArchitectureReader, FindsTheIncludesOfPade) {
  const std::string source =
      "#include <vector>\n#include \"pade/core/pose.hpp\"\n  #  include <pade/io/text.hpp>\n// #include "
      "\"pade/x.hpp\"\n";
  EXPECT_THAT(pade_includes(source), ElementsAre("core/pose.hpp", "io/text.hpp"));
}

TEST(ArchitectureReader, AllowsARoomItselfItsRowAndSingleHeaders) {
  const std::string design =
      "# T\n## Rooms\n| room | may include |\n|---|---|\n| `depth` | x | `core`, `flow/flow_estimator.hpp` "
      "|\n"
      "| `core` | x | - |\n## Other\n| `flow` | x | `core` |\n";
  const Rules rules = rules_of(design);
  EXPECT_EQ(rules.size(), 2U);
  EXPECT_TRUE(allowed(rules, "depth", "depth/pade.hpp"));
  EXPECT_TRUE(allowed(rules, "depth", "core/pose.hpp"));
  EXPECT_TRUE(allowed(rules, "depth", "flow/flow_estimator.hpp"));
  EXPECT_FALSE(allowed(rules, "depth", "flow/opencv_estimators.hpp"));
  EXPECT_FALSE(allowed(rules, "core", "depth/pade.hpp"));
  EXPECT_FALSE(allowed(rules, "flow", "core/pose.hpp"));
}

TEST(ArchitectureReader, IgnoresCommentsAndStringsButKeepsTheLines) {
  EXPECT_EQ(without_comments_and_strings("a // throw\nb"), "a         \nb");
  EXPECT_EQ(without_comments_and_strings("b /* x\ny */ c"), "b     \n     c");
  EXPECT_EQ(without_comments_and_strings(R"x("a \" throw" c)x"), std::string(12, ' ') + " c");
  EXPECT_EQ(without_comments_and_strings("'\"' c 1'000 d '/'"), "    c 1'000 d    ");
  EXPECT_EQ(without_comments_and_strings("R\"(a \" b)\" c"), "           c");
}

}  // namespace
}  // namespace pade::architecture
