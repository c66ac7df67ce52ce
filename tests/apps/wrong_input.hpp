// Wrong inputs as they happen: what the program says is what a person can act on. The messages of each are
// printed where PADE_SHOW_MESSAGES is set.
#pragma once

#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <random>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "apps/run_program.hpp"

namespace pade::test {

/// One wrong input.
struct Wrong {
  const char* name;
  void (*make)(const std::filesystem::path&);  ///< in an empty folder
  const char* command;  ///< behind "pade", from that folder; OUT stands for one that does not exist
  int code;
  std::vector<const char*> says;
};

/// The rows of several tables.
template <class... Tables>
std::vector<Wrong> together(const Tables&... tables) {
  std::vector<Wrong> rows;
  (rows.insert(rows.end(), std::begin(tables), std::end(tables)), ...);
  return rows;
}

/// Makes the input in a folder of its own, runs the program there and looks for what it says. Output is left
/// behind where the exit code is 0, and only there.
inline void expect_named(const Wrong& wrong) {
  namespace fs = std::filesystem;
  const fs::path work = fs::temp_directory_path() / fmt::format("pade_wrong_{}", std::random_device{}());
  fs::create_directories(work);
  wrong.make(work);
  std::string command = wrong.command;
  command.replace(command.find("OUT"), 3, "out");
  const Outcome outcome = shell("cd " + work.string() + " && " + kPade + " " + command);
  const bool left = fs::exists(work / "out");
  fs::remove_all(work);
  if (std::getenv("PADE_SHOW_MESSAGES") != nullptr) {
    std::cout << wrong.name << ": " << outcome.code << '\n' << outcome.text << '\n';
  }
  EXPECT_EQ(outcome.code, wrong.code) << outcome.text;
  EXPECT_EQ(left, wrong.code == 0) << "something was left behind, or nothing was made";
  for (const char* part : wrong.says) EXPECT_THAT(outcome.text, testing::HasSubstr(part));
}

}  // namespace pade::test
