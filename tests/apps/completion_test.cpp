// `pade completion SHELL` against the oracle of `pade ... --help`, and by asking bash itself what it
// completes.
#include <array>
#include <cstdio>
#include <regex>
#include <set>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pade/flow/flow_estimator.hpp"

#include "apps/run_program.hpp"

namespace pade {
namespace {

using test::kPade;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsSupersetOf;
using ::testing::Not;

/// Standard output of a shell command.
std::string output_of(const std::string& command) {
  std::string output;
  FILE* pipe = popen(command.c_str(), "r");
  if (pipe == nullptr) return output;
  std::array<char, 4096> buffer{};
  while (const auto n = std::fread(buffer.data(), 1, buffer.size(), pipe)) output.append(buffer.data(), n);
  pclose(pipe);
  return output;
}

bool installed(const std::string& program) { return !output_of("command -v " + program).empty(); }

std::vector<std::string> matches(const std::string& text, const std::regex& pattern) {
  std::vector<std::string> found;
  for (std::sregex_iterator match(text.begin(), text.end(), pattern), end; match != end; ++match) {
    found.push_back((*match)[1]);
  }
  return found;
}

/// The names under "Subcommands:" of a help text.
std::vector<std::string> subcommands(const std::string& help) {
  const auto section = help.find("\nSubcommands:");
  if (section == std::string::npos) return {};
  return matches(help.substr(section), std::regex("\n  ([a-z][a-z-]*)"));
}

/// Every command of the program ("", "map", "flow evaluate") with the long options that its help names.
void collect(const std::string& path,
             std::vector<std::pair<std::string, std::vector<std::string>>>& commands) {
  const std::string help = output_of(kPade + " " + path + " --help");
  commands.emplace_back(path, matches(help, std::regex("\n  (?:-[A-Za-z],)?(--[a-z-]+)")));
  for (const auto& name : subcommands(help)) collect(path.empty() ? name : path + " " + name, commands);
}

/// Asked once: each command's help is a process of its own.
const std::vector<std::pair<std::string, std::vector<std::string>>>& all_commands() {
  static const auto commands = [] {
    std::vector<std::pair<std::string, std::vector<std::string>>> found;
    collect("", found);
    return found;
  }();
  return commands;
}

/// What bash offers after typing `line` (its last word may be empty).
std::set<std::string> bash_offers(std::vector<std::string> line) {
  std::string words;
  for (const auto& word : line) words += " '" + word + "'";
  const std::string script = "source <('" + kPade + "' completion bash); COMP_WORDS=(" + words +
                             "); COMP_CWORD=" + std::to_string(line.size() - 1) +
                             "; _pade; printf '%s\\n' \"${COMPREPLY[@]}\"";
  const std::string output = output_of("bash -c \"$(cat <<'SCRIPT'\n" + script + "\nSCRIPT\n)\"");
  std::set<std::string> offers;
  for (auto& word : matches(output, std::regex("([^\n]+)\n"))) offers.insert(word);
  return offers;
}

class Completion : public ::testing::TestWithParam<std::string> {};

TEST_P(Completion, NamesEverySubcommandAndLongOptionOfTheHelp) {
  const std::string script = output_of(kPade + " completion " + GetParam());
  const auto& commands = all_commands();
  ASSERT_GE(commands.size(), 3U);
  for (const auto& [path, options] : commands) {
    EXPECT_THAT(options, Contains("--help")) << path;
    for (const auto& option : options) {
      const std::string written = GetParam() == "fish" ? " -l " + option.substr(2) : option;
      EXPECT_TRUE(std::regex_search(script, std::regex(written + "([^a-z-]|$)"))) << path << " " << option;
    }
    const std::string name = path.substr(path.rfind(' ') + 1);
    EXPECT_THAT(script, HasSubstr(name));
  }
}

TEST_P(Completion, IsAScriptThatItsShellAccepts) {
  if (!installed(GetParam())) GTEST_SKIP() << GetParam() << " is not installed";
  EXPECT_EQ(output_of("bash -c \"" + GetParam() + " -n <('" + kPade + "' completion " + GetParam() +
                      ") 2>&1 && echo accepted\""),
            "accepted\n");
}

INSTANTIATE_TEST_SUITE_P(Shells, Completion, ::testing::Values("bash", "zsh", "fish"),
                         [](const auto& shell) { return shell.param; });

TEST(CompletionInBash, OffersTheSubcommandsThenTheirOptions) {
  EXPECT_THAT(bash_offers({"pade", "comp"}), ::testing::ElementsAre("completion"));
  EXPECT_THAT(bash_offers({"pade", ""}), IsSupersetOf({"flow", "completion"}));
  EXPECT_THAT(bash_offers({"pade", "completion", ""}), ::testing::ElementsAre("bash", "fish", "zsh"));
  EXPECT_THAT(bash_offers({"pade", "completion", "--h"}), ::testing::ElementsAre("--help"));
}

TEST(CompletionInBash, OffersTheWordsThatAnOptionTakes) {
  const auto& names = flow::flow_estimator_names();
  EXPECT_THAT(bash_offers({"pade", "flow", "--flow", ""}), IsSupersetOf(names));
  EXPECT_THAT(bash_offers({"pade", "flow", "--flow", "=", "dis-"}), Contains("dis-fast"));
  EXPECT_THAT(bash_offers({"pade", "flow", "--flow", "dis-"}), Not(Contains("opencv-farneback")));
}

TEST(CompletionInBash, LeavesFileNamesToTheShell) {
  EXPECT_THAT(bash_offers({"pade", "flow", "--out", ""}), ::testing::IsEmpty());
}

TEST(CompletionCommand, RefusesAShellThatItDoesNotKnow) {
  EXPECT_EQ(output_of(kPade + " completion tcsh 2>/dev/null || echo refused"), "refused\n");
}

}  // namespace
}  // namespace pade
