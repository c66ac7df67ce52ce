// `pade experiment` as a user meets it: what it refuses, and that a killed run goes on.
#include <filesystem>
#include <fstream>
#include <memory>
#include <sstream>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "apps/run_program.hpp"
#include "support/temporary_folder.hpp"

namespace pade {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::HasSubstr;

using test::kPade;
using test::Outcome;
using test::shell;

/// The sample flight that ctest has made once for all tests.
const std::string kSampleFlight = PADE_SAMPLE_FLIGHT;

class Experiment : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    root_ = std::make_unique<test::TemporaryFolder>();
    ASSERT_TRUE(fs::exists(kSampleFlight))
        << "run through ctest, or make it: pade sample --frames 5 --out " << kSampleFlight;
  }
  static void TearDownTestSuite() { root_.reset(); }

  static std::string at(const std::string& name) { return (root_->path() / name).string(); }
  static Outcome experiment(const std::string& arguments) {
    return shell(kPade + " experiment " + arguments);
  }
  static std::string on_flight(const std::string& table, const std::string& out) {
    return table + " --flow dis-ultrafast --jobs 1 --sequences " + kSampleFlight + " --out " + at(out);
  }
  static void expect_refused(const Outcome& outcome, const std::string& named, const std::string& out) {
    EXPECT_NE(outcome.code, 0) << outcome.text;
    EXPECT_THAT(outcome.text, HasSubstr(named));
    EXPECT_FALSE(fs::exists(root_->path() / out)) << "something was left behind";
  }

  static inline std::unique_ptr<test::TemporaryFolder> root_;
};

TEST_F(Experiment, RefusesWhatItDoesNotKnow) {
  expect_refused(experiment(on_flight("table9", "none")), "table9", "none");
  expect_refused(experiment("table1 --flow magic --sequences " + kSampleFlight + " --out " + at("none")),
                 "magic", "none");
  for (const char* shard : {"0/3", "4/3", "1", "a/b", "1/0", "1.5/3"})
    expect_refused(experiment(on_flight("table1", "none") + " --shard " + shard), "expected i/n", "none");
  expect_refused(experiment("table1 --sequences " + at("nowhere") + " --out " + at("none")), "nowhere",
                 "none");
  expect_refused(experiment("merge --out " + at("none")), "expected those of the shards", "none");
  expect_refused(experiment("merge " + kSampleFlight + " --out " + at("none")), "plan.json", "none");
}

TEST_F(Experiment, RefusesASequenceWithoutTruth) {
  fs::copy(kSampleFlight, root_->path() / "blind", fs::copy_options::recursive);
  fs::remove_all(root_->path() / "blind" / "depth");
  fs::remove(root_->path() / "blind" / "depth.txt");
  expect_refused(experiment("table1 --sequences " + at("blind") + " --out " + at("none")), "no true depth",
                 "none");
}

TEST_F(Experiment, RefusesAPlaceThatCannotBeWritten) {
  expect_refused(experiment("table1 --sequences " + kSampleFlight + " --out /proc/none"), "/proc/none",
                 "none");
  std::ofstream(root_->path() / "file") << "x";
  const Outcome outcome = experiment("table1 --sequences " + kSampleFlight + " --out " + at("file"));
  EXPECT_EQ(outcome.code, 1);
  EXPECT_THAT(outcome.text, HasSubstr("found a file"));
}

TEST_F(Experiment, LeavesAFinishedOneAloneUnlessForced) {
  const Outcome first = experiment(on_flight("table1", "finished"));
  ASSERT_EQ(first.code, 0) << first.text;
  EXPECT_THAT(first.text, AllOf(HasSubstr("Table 1"), HasSubstr("PADE exact"), HasSubstr("report.html")));
  const Outcome again = experiment(on_flight("table1", "finished"));
  EXPECT_EQ(again.code, 1);
  EXPECT_THAT(again.text, HasSubstr("--force"));
  EXPECT_EQ(experiment(on_flight("table1", "finished") + " --force").text, first.text);
}

TEST_F(Experiment, GoesOnAfterBeingKilled) {
  ASSERT_EQ(experiment(on_flight("errata", "whole")).code, 0);
  // Killed outright, wherever it is by then; whatever it has is taken up.
  for (const char* after : {"0.05", "0.3", "0.6"})
    experiment(on_flight("errata", "killed") + " & sleep " + after + "; kill -9 $!; wait");
  const Outcome last = experiment(on_flight("errata", "killed"));
  if (last.code != 0) {  // it was faster than the killer
    EXPECT_THAT(last.text, HasSubstr("finished"));
  }
  for (const char* file : {"experiment.json", "cells.csv", "results.md", "report.html"}) {
    std::ostringstream whole;
    std::ostringstream killed;
    whole << std::ifstream(root_->path() / "whole" / file).rdbuf();
    killed << std::ifstream(root_->path() / "killed" / file).rdbuf();
    EXPECT_EQ(killed.str(), whole.str()) << file;
  }
}

}  // namespace
}  // namespace pade
