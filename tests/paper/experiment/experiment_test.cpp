// The engine of the experiments on a tiny flight: what is finished is never done again, and whoever shares
// the work out, or comes back to it, gets the same bytes.
#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <memory>
#include <set>
#include <sstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pade/paper/experiment/experiment_results.hpp"
#include "pade/paper/experiment/experiment_run.hpp"
#include "pade/paper/tables/experiment_finish.hpp"
#include "pade/paper/tables/experiment_tables.hpp"

#include "paper/experiment/tiny_flight.hpp"
#include "support/temporary_folder.hpp"

namespace pade::experiment {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::HasSubstr;
using testing::IsEmpty;

class ExperimentRun : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    root_ = std::make_unique<test::TemporaryFolder>();
    for (const char* name : {"forward", "sideways", "turning"})
      test::write_flight(root_->path() / name, name);
    PlanOptions options;
    options.flows = "lucas-kanade-half";
    options.draws = 2;
    auto made = make_experiment(
        options, {root_->path() / "forward", root_->path() / "sideways", root_->path() / "turning"});
    ASSERT_TRUE(made) << made.error().message;
    experiment_ = std::make_unique<Experiment>(std::move(made).value());
    ASSERT_EQ(complete("whole", {2, 1, 1}), "");
  }
  static void TearDownTestSuite() {
    experiment_.reset();
    root_.reset();
  }

  static Result<Store> open(const std::string& name, bool again = false) {
    auto store = Store::open(root_->path() / name, again);
    if (!store) return store;
    if (Status s = store->write_file(plan_file, to_json(*experiment_)); !s) return s.error();
    return store;
  }

  /// Does one share; empty or what went wrong.
  static std::string work(const std::string& name, const Share& share) {
    const auto store = open(name);
    if (!store) return store.error().message;
    const Status done = do_tasks(tasks_of(*experiment_), *store, share, {});
    return done ? "" : done.error().message;
  }

  static std::string complete(const std::string& name, const Share& share) {
    if (std::string wrong = work(name, share); !wrong.empty()) return wrong;
    const auto store = Store::open(root_->path() / name, true);
    const auto text = finish(*experiment_, *store);
    return text ? "" : text.error().message;
  }

  /// Every file of a folder but timing.json; of the report and the Markdown what comes before the times.
  static std::map<std::string, std::string> content(const std::string& name) {
    std::map<std::string, std::string> files;
    const fs::path folder = root_->path() / name;
    for (const auto& entry : fs::recursive_directory_iterator(folder)) {
      const std::string file = entry.path().lexically_relative(folder);
      if (!entry.is_regular_file() || file == timing_file) continue;
      std::ostringstream text;
      text << std::ifstream(entry.path(), std::ios::binary).rdbuf();
      std::string bytes = text.str();
      if (file == "report.html") bytes = bytes.substr(0, bytes.find("<h2 id=\"table2\">"));
      if (file == "results.md") bytes = bytes.substr(0, bytes.find("## Table 2"));
      files[file] = bytes;
    }
    return files;
  }

  static inline std::unique_ptr<test::TemporaryFolder> root_;
  static inline std::unique_ptr<Experiment> experiment_;
};

TEST_F(ExperimentRun, WritesEveryTableOfThePlan) {
  const auto files = content("whole");
  for (const char* name : {"plan.json", "experiment.json", "cells.csv", "results.md", "report.html"})
    EXPECT_TRUE(files.contains(name)) << name;
  EXPECT_FALSE(fs::exists(root_->path() / "whole" / "timing"));
  EXPECT_TRUE(fs::exists(root_->path() / "whole" / timing_file));
  for (const char* table :
       {"\"table1\"", "\"figure3\"", "\"figure4\"", "\"windows\"", "\"errata\"", "\"verdicts\""})
    EXPECT_THAT(files.at("experiment.json"), HasSubstr(table));
}

TEST_F(ExperimentRun, AnInterruptedRunGoesOnWithoutRepeatingAndGivesTheSameBytes) {
  const auto store = open("interrupted");
  ASSERT_TRUE(store);
  auto tasks = tasks_of(*experiment_);
  // The seventh job fails, as if the machine had.
  auto broken = tasks;
  broken[6].work = [](const auto&) -> Result<std::string> { return Error{"power cut"}; };
  const Status stopped = do_tasks(broken, *store, {1, 1, 1}, {});
  ASSERT_FALSE(stopped);
  EXPECT_THAT(stopped.error().message, HasSubstr("power cut"));
  int repeated = 0;
  int finished = 0;
  for (Task& task : tasks) {
    if (!store->has(task.name, task.timing)) continue;
    ++finished;
    task.work = [&repeated](const auto&) -> Result<std::string> {
      ++repeated;
      return Error{"done before"};
    };
  }
  EXPECT_EQ(finished, 6);
  ASSERT_TRUE(do_tasks(tasks, *store, {2, 1, 1}, {}));
  EXPECT_EQ(repeated, 0);
  ASSERT_TRUE(finish(*experiment_, *store));
  EXPECT_EQ(content("interrupted"), content("whole"));
}

TEST_F(ExperimentRun, ShardsMergeToTheSameBytes) {
  std::vector<fs::path> folders;
  std::size_t jobs = 0;
  for (int i = 1; i <= 3; ++i) {
    const std::string name = "shard" + std::to_string(i);
    ASSERT_EQ(work(name, {1, i, 3}), "");
    folders.push_back(root_->path() / name);
    for ([[maybe_unused]] const auto& file : fs::directory_iterator(folders.back() / "jobs")) ++jobs;
    for ([[maybe_unused]] const auto& file : fs::directory_iterator(folders.back() / "timing")) ++jobs;
  }
  EXPECT_EQ(jobs, tasks_of(*experiment_).size());  // nothing was done twice
  const auto merged = merged_experiment(folders);
  ASSERT_TRUE(merged) << merged.error().message;
  const auto store = Store::open(root_->path() / "merged", false);
  ASSERT_TRUE(store->write_file(plan_file, to_json(*merged)));
  ASSERT_TRUE(copy_jobs(*merged, folders, *store));
  ASSERT_TRUE(finish(*merged, *store));
  EXPECT_EQ(content("merged"), content("whole"));
}

TEST_F(ExperimentRun, MergingTooFewShardsNamesWhatIsMissing) {
  ASSERT_EQ(work("first", {1, 1, 3}), "");
  const auto store = Store::open(root_->path() / "incomplete", false);
  ASSERT_TRUE(copy_jobs(*experiment_, {root_->path() / "first"}, *store));
  const auto text = finish(*experiment_, *store);
  ASSERT_FALSE(text);
  EXPECT_THAT(text.error().message, AllOf(HasSubstr("unfinished"), HasSubstr("expected all of them")));
  EXPECT_FALSE(fs::exists(root_->path() / "incomplete" / finished_file));
}

TEST_F(ExperimentRun, ADamagedJobIsNamedAndNeverACrash) {
  fs::copy(root_->path() / "whole", root_->path() / "damaged", fs::copy_options::recursive);
  std::set<std::string> tried;
  for (const auto& entry : fs::directory_iterator(root_->path() / "damaged" / "jobs")) {
    const std::string name = entry.path().stem();
    if (!tried.insert(name.substr(0, name.find('-'))).second) continue;  // one of each table
    std::ostringstream whole;
    whole << std::ifstream(entry.path()).rdbuf();
    std::string renamed = whole.str();
    for (const std::string key : {"\"flown_m\"", "\"truth\""}) {
      for (auto at = renamed.find(key); at != std::string::npos; at = renamed.find(key))
        renamed.replace(at, key.size(), "\"lost\"");
    }
    for (const std::string& damaged :
         {std::string("{}"), whole.str().substr(0, whole.str().size() / 2), renamed}) {
      std::ofstream(entry.path()) << damaged;
      const auto store = Store::open(root_->path() / "damaged", true);
      const auto text = finish(*experiment_, *store);
      ASSERT_FALSE(text.ok()) << name;
      EXPECT_THAT(text.error().message, HasSubstr(name));
    }
    std::ofstream(entry.path()) << whole.str();
  }
  EXPECT_TRUE(tried.contains("figure4"));
}

TEST_F(ExperimentRun, ATableMadeAloneHasTheFiguresOfTheWhole) {
  Experiment alone = *experiment_;
  alone.options.tables = "table1";
  const auto store = Store::open(root_->path() / "alone", false);
  ASSERT_TRUE(do_tasks(tasks_of(alone), *store, {1, 1, 1}, {}));
  const auto some = read_results(alone, *store);
  const auto all = read_results(*experiment_, *Store::read_only(root_->path() / "whole"));
  ASSERT_TRUE(some && all);
  EXPECT_EQ(table1(*some).rows, table1(*all).rows);
}

TEST_F(ExperimentRun, TtcSaysNoDepthSidewaysAndPadeAnswers) {
  const auto results = read_results(*experiment_, *Store::read_only(root_->path() / "whole"));
  ASSERT_TRUE(results);
  for (const std::string_view cell : {ttc, ttc_exact}) {
    for (const SequenceCell& one : results->cells("table1", "lucas-kanade-half", cell)) {
      const evaluation::RangeAccuracy& all = one.cell->accuracy.all;
      if (one.sequence == "sideways") {
        EXPECT_EQ(all.pixels, 0U) << cell;
      } else if (one.sequence == "forward") {
        EXPECT_GT(all.coverage, 0.3) << cell;
      }
    }
  }
  for (const SequenceCell& one : results->cells("table1", "lucas-kanade-half", pade_exact))
    EXPECT_GT(one.cell->accuracy.all.coverage, 0.3) << one.sequence;
}

TEST_F(ExperimentRun, TheSignsOfEquation1AsPrintedLeaveNoDepth) {
  const auto results = read_results(*experiment_, *Store::read_only(root_->path() / "whole"));
  ASSERT_TRUE(results);
  const auto right = mean_over(results->cells("errata", "", "pade-literal"));
  const auto printed = mean_over(results->cells("errata", "", to_name(Misreading::signs_of_eq1)));
  EXPECT_GT(right.all.coverage, 0.5);
  EXPECT_LT(printed.all.coverage, 0.2 * right.all.coverage);
}

TEST(ExperimentPlan, KeysTellEveryInputApart) {
  const PlanOptions options;
  const auto jobs = plan(options, {"a"});
  std::set<std::string> names;
  for (const Job& job : jobs) names.insert(job_name(job, "x"));
  EXPECT_EQ(names.size(), jobs.size());
  Job job = jobs.front();
  const std::string before = job_name(job, "x");
  EXPECT_EQ(job_name(job, "x"), before);
  EXPECT_NE(job_name(job, "y"), before);  // another content of the sequence
  const auto changed = [&](const std::function<void(Job&)>& change) {
    Job other = job;
    change(other);
    return job_name(other, "x") != before;
  };
  EXPECT_TRUE(changed([](Job& j) { j.range = 30; }));
  EXPECT_TRUE(changed([](Job& j) { j.step = 2; }));
  EXPECT_TRUE(changed([](Job& j) { j.seed = 2; }));
  EXPECT_TRUE(changed([](Job& j) { j.draws = 3; }));
  EXPECT_TRUE(changed([](Job& j) { j.grid = 2; }));
  EXPECT_TRUE(changed([](Job& j) { j.noise.level = 0.1; }));
  EXPECT_TRUE(changed([](Job& j) { j.flow = "dis-fast"; }));
  EXPECT_TRUE(changed([](Job& j) { j.derotation = depth::Derotation::image; }));
  EXPECT_TRUE(changed([](Job& j) { j.cells.front().depth.window = 8; }));
  EXPECT_TRUE(changed([](Job& j) { j.cells.front().misreading = Misreading::without_tz; }));
  EXPECT_TRUE(changed([](Job& j) { j.cells.front().measured = evaluation::Measured::speed_alone; }));
}

TEST(ExperimentPlan, SurvivesItsFile) {
  Experiment experiment;
  experiment.options.tables = "figure3";
  experiment.options.flows = "farneback,dis-fast";
  experiment.options.source = "--sequences a b";
  experiment.options.range = 12.5;
  experiment.sequences = {{"a", {}, "0123"}, {"b", {}, "4567"}};
  const auto read = experiment_from_json(to_json(experiment), "plan.json");
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(to_json(*read), to_json(experiment));
  EXPECT_FALSE(experiment_from_json("[]", "plan.json"));
  EXPECT_THAT(experiment_from_json("{", "plan.json").error().message, HasSubstr("plan.json"));
}

TEST(ExperimentStore, RefusesFoldersThatAreNotItsOwn) {
  const test::TemporaryFolder root;
  fs::create_directories(root / "photos");
  std::ofstream(root / "photos/holiday.jpg") << "x";
  EXPECT_THAT(Store::open(root / "photos", true).error().message, HasSubstr("plan.json"));
  std::ofstream(root / "file") << "x";
  EXPECT_THAT(Store::open(root / "file", true).error().message, HasSubstr("found a file"));
  const auto store = Store::open(root / "new", false);
  ASSERT_TRUE(store);
  ASSERT_TRUE(store->write_file(plan_file, "{}"));
  EXPECT_TRUE(Store::open(root / "new", false));  // unfinished: go on
  ASSERT_TRUE(store->write_file(finished_file, "{}"));
  EXPECT_THAT(Store::open(root / "new", false).error().message, HasSubstr("--force"));
  EXPECT_TRUE(Store::open(root / "new", true));
}

TEST(FolderFingerprint, ChangesWithNamesAndContents) {
  const test::TemporaryFolder root;
  fs::create_directories(root / "a/sub");
  std::ofstream(root / "a/sub/x") << "1";
  const std::string before = *folder_fingerprint(root / "a");
  EXPECT_EQ(*folder_fingerprint(root / "a"), before);
  std::ofstream(root / "a/.hidden") << "work of others";
  EXPECT_EQ(*folder_fingerprint(root / "a"), before);
  std::ofstream(root / "a/sub/x") << "2";
  const std::string content = *folder_fingerprint(root / "a");
  EXPECT_NE(content, before);
  fs::rename(root / "a/sub/x", root / "a/sub/y");
  EXPECT_NE(*folder_fingerprint(root / "a"), content);
}

}  // namespace
}  // namespace pade::experiment
