// `pade simulate` as a user meets it: the worlds that it writes, and options that would do nothing.
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "apps/run_program.hpp"
#include "support/temporary_folder.hpp"

namespace pade {
namespace {

namespace fs = std::filesystem;
using test::kPade;
using test::Outcome;
using test::shell;
using testing::HasSubstr;

std::string content_of(const fs::path& file) {
  std::ostringstream bytes;
  bytes << std::ifstream(file, std::ios::binary).rdbuf();
  return bytes.str();
}

TEST(SimulateCommand, KeepsAWorldThatSomebodyChangedUnlessForced) {
  const test::TemporaryFolder folder;
  const fs::path world = folder / "forest.sdf";
  const std::string cache = "XDG_CACHE_HOME=" + (folder / "cache").string() + " ";
  for (const std::string density : {"", " --density 20"}) {
    const std::string command =
        cache + kPade + " simulate --random forest --seed 2 --write-world " + world.string() + density;
    ASSERT_EQ(shell(command).code, 0);
    const std::string made = content_of(world);
    EXPECT_THAT(made, HasSubstr("<uri>meshes/forest_tree0_wood.obj"));
    EXPECT_TRUE(fs::exists(folder / "meshes" / "forest_tree0_wood.obj"));
    EXPECT_EQ(shell(command).code, 0) << "the same again";
    std::ofstream(world, std::ios::app) << "<!-- by hand -->\n";
    const Outcome refused = shell(command);
    EXPECT_EQ(refused.code, 1);
    EXPECT_THAT(refused.text, testing::AllOf(HasSubstr(world.string()), HasSubstr("--force")));
    EXPECT_EQ(content_of(world), made + "<!-- by hand -->\n");
    EXPECT_EQ(shell(command + " --force").code, 0);
    EXPECT_EQ(content_of(world), made);
    fs::remove(world);
    fs::remove_all(folder / "meshes");
  }
}

TEST(SimulateCommand, RefusesOptionsThatWouldDoNothing) {
  const test::TemporaryFolder folder;
  const std::string world = (folder / "w.sdf").string();
  const std::string out = " -o " + (folder / "out").string();
  struct Case {
    std::string options;
    const char* named;
  };
  for (const Case& one : {Case{"none.sdf --random forest --write-world " + world, "none.sdf"},
                          {"none.sdf --set paper --quick" + out, "none.sdf"},
                          {"--random forest --flight none.yaml --write-world " + world, "--flight"},
                          {"--random forest --preview --write-world " + world, "--preview"},
                          {"--random forest --quick --seed 3" + out, "--quick"},
                          {"--random forest --resource-path here" + out, "--resource-path"},
                          {"--random forest --preview --samples 2" + out, "--samples"},
                          {"none.sdf --flight none.yaml --write-world " + world + out, "--write-world"},
                          {"none.sdf --flight none.yaml --density 50" + out, "--density"},
                          {"--set paper --colour" + out, "--colour"},
                          {"--set paper --random forest" + out, "--random"}}) {
    const Outcome outcome = shell(kPade + " simulate " + one.options);
    EXPECT_EQ(outcome.code, 1) << one.options;
    EXPECT_THAT(outcome.text, testing::AllOf(HasSubstr(one.named), HasSubstr("would do nothing")))
        << one.options;
    EXPECT_EQ(folder.entries(), 0U) << one.options;
  }
}

}  // namespace
}  // namespace pade
