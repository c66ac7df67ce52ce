// The same figures as table, CSV and JSON.
#include "pade/report/tables/accuracy_tables.hpp"

#include <cmath>
#include <sstream>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "evaluation/synthetic_depth.hpp"

namespace pade::evaluation {
namespace {
using testing::HasSubstr;

DepthAccuracy some_accuracy() {
  const cv::Mat truth = test::truth_ramp({64, 48});
  Accumulator accumulator(9.5);
  accumulator.add(test::noisy_estimate(truth, 0.1, 1), truth);
  return accumulator.result();
}

TEST(AccuracyJson, GivesBackEveryFigureToTheBit) {
  const DepthAccuracy written = some_accuracy();
  ASSERT_EQ(written.ranges[4].pixels, 0U) << "one range must be without estimates";
  const auto read = accuracy_from_json(to_json(written), "evaluation.json");
  ASSERT_TRUE(read.ok()) << read.error().message;
  EXPECT_EQ(to_json(*read), to_json(written));
  EXPECT_EQ(read->all.median, written.all.median);
  EXPECT_TRUE(std::isnan(read->ranges[4].mean));
  EXPECT_TRUE(std::isinf(read->ranges[4].to));
  EXPECT_EQ(read->max_depth, 9.5);
}

TEST(AccuracyJson, RefusesWhatIsNotThat) {
  for (const char* text :
       {"", "[]", "{}", "{\"frames\":1,\"max_depth_m\":0,\"ranges\":[]}", "{\"frames\":\"x\"}"}) {
    const auto read = accuracy_from_json(text, "evaluation.json");
    ASSERT_FALSE(read.ok()) << text;
    EXPECT_THAT(read.error().message, HasSubstr("evaluation.json"));
  }
}

TEST(AccuracyCsv, HasAsManyFieldsInEveryRow) {
  std::istringstream lines(to_csv(some_accuracy()));
  std::string line;
  int rows = 0;
  for (; std::getline(lines, line); ++rows) EXPECT_EQ(std::count(line.begin(), line.end(), ','), 15) << line;
  EXPECT_EQ(rows, 7);
}

TEST(AccuracyTable, ShowsSigmaOnlyWhereThereIsOne) {
  EXPECT_THAT(to_table(some_accuracy()), HasSubstr("rms e/σ"));
  const cv::Mat truth = test::truth_ramp({8, 8});
  DepthImage without = test::noisy_estimate(truth, 0.1, 1);
  without.variance = cv::Mat();
  Accumulator accumulator;
  accumulator.add(without, truth);
  EXPECT_THAT(to_table(accumulator.result()), testing::Not(HasSubstr("σ ")));
}

}  // namespace
}  // namespace pade::evaluation
