// The jobs beyond the paper: the whole chain on a short flight.
#include <cmath>
#include <filesystem>
#include <string>

#include <gtest/gtest.h>

#include "pade/paper/experiment/experiment_chain.hpp"
#include "pade/paper/experiment/experiment_plan.hpp"
#include "pade/paper/experiment/experiment_results.hpp"
#include "pade/paper/tables/beyond_tables.hpp"

#include "paper/experiment/tiny_flight.hpp"
#include "support/temporary_folder.hpp"

namespace pade::experiment {
namespace {

using evaluation::MotionNoise;
using evaluation::NoiseModel;

class Chain : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    root_ = std::make_unique<test::TemporaryFolder>();
    test::write_flight(root_->path() / "forward", "forward", 10, simulation::analytic_camera(320, 240));
    sequence_ = std::make_unique<io::Sequence>(io::Sequence::open(root_->path() / "forward").value());
  }
  static void TearDownTestSuite() {
    sequence_.reset();
    root_.reset();
  }
  static std::vector<Job> jobs() {
    PlanOptions options;
    options.tables = "beyond";
    return plan(options, {"forward"});
  }
  static JobResult run(const std::string& chain, const MotionNoise& noise) {
    for (const Job& job : jobs()) {
      if (job.chain == chain && job.noise.model == noise.model && job.noise.level == noise.level)
        return run_job(job, *sequence_, {}).value();
    }
    ADD_FAILURE() << "no such job";
    return {};
  }
  static double error(const JobResult& result, const std::string& cell) {
    return result.cell(cell)->accuracy.all.mean;
  }
  static double median(const JobResult& result, const std::string& cell) {
    return result.cell(cell)->accuracy.all.median;
  }

  static inline std::unique_ptr<test::TemporaryFolder> root_;
  static inline std::unique_ptr<io::Sequence> sequence_;
};

TEST_F(Chain, ThePlanHasEveryStepOnceAndThoseOfNoiseOnlyWithIt) {
  std::size_t expected = 0;
  for (const MotionNoise& noise : chain_noises()) {
    for (const ChainMethod& method : chain_methods()) expected += noise.level > 0 || !method.only_with_noise;
  }
  EXPECT_EQ(jobs().size(), expected);
  std::set<std::string> names;
  for (const Job& job : jobs()) names.insert(job_name(job, "fingerprint"));
  EXPECT_EQ(names.size(), expected) << "two jobs share a key";
}

TEST_F(Chain, EachStepIsBetterThanThePaperAndSeesMostPixels) {
  const JobResult literal = run("literal", {});
  for (const std::string name : {"one-pair", "two-view", "multi-view"}) {
    const JobResult result = run(name, {});
    EXPECT_LT(error(result, name), 0.8 * error(literal, "literal")) << name;
    EXPECT_GT(result.cell(name)->accuracy.all.coverage, 0.7) << name;
    // With exact poses the scale is right.
    EXPECT_NEAR(error(result, scaled_cell(name)) / error(result, name), 1, 0.1) << name;
  }
}

TEST_F(Chain, NoiseLeavesTheDefaultLittleButItsScale) {
  const MotionNoise noise{NoiseModel::multiplicative, 0.20};
  const JobResult given = run("multi-view-given", noise);
  const JobResult aligned = run("multi-view", noise);
  EXPECT_LT(error(aligned, "multi-view"), error(given, "multi-view-given"));
  EXPECT_LT(error(aligned, scaled_cell("multi-view")), 0.6 * error(aligned, "multi-view"));
  EXPECT_LT(median(aligned, scaled_cell("multi-view")), 0.6 * median(given, scaled_cell("multi-view-given")));
}

TEST_F(Chain, AJobGivesTheSameEachTimeAndComesBackFromItsFile) {
  const MotionNoise noise{NoiseModel::additive, 0.05};
  const JobResult once = run("two-view", noise);
  const std::string text = to_json(once);
  EXPECT_EQ(text, to_json(run("two-view", noise)));
  const auto again = job_result_from_json(text, "job.json");
  ASSERT_TRUE(again) << again.error().message;
  EXPECT_EQ(to_json(*again), text);
}

TEST_F(Chain, TheTableHasARowPerStepAndNoise) {
  Results results;
  results.options.tables = "beyond";
  results.sequences = {"forward"};
  for (const Job& job : jobs()) {
    if (job.chain != "literal" && job.chain != "one-pair") continue;
    results.jobs.push_back({job, run_job(job, *sequence_, {}).value()});
  }
  const evaluation::ResultTable table = beyond_table(results);
  EXPECT_EQ(table.rows.size(), jobs().size());
  EXPECT_EQ(table.rows.front().front(), "none");
  EXPECT_EQ(table.rows.back().front(), "additive, 10 %");
  EXPECT_EQ(table.rows[2][3], "–") << "a step whose job is not there";
  EXPECT_NE(table.rows[0][3], "–");
}

}  // namespace
}  // namespace pade::experiment
