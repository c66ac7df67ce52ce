#include "pade/report/tables/result_table.hpp"

#include <limits>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "pade/evaluation/range_means.hpp"

namespace pade::evaluation {
namespace {

ResultTable small() {
  return {"t", "Times", "", "A note.", {"flow", "ms"}, {{"clg", "12.5"}, {"farnebäck", "–"}}};
}

TEST(ResultTable, AlignsByCharactersNotBytes) {
  EXPECT_EQ(to_text(small()),
            "Times\n\n"
            "flow         ms\n"
            "clg        12.5\n"
            "farnebäck     –\n"
            "\nA note.\n");
}

TEST(ResultTable, IsMarkdown) {
  EXPECT_EQ(to_markdown(small()), "| flow | ms |\n|---|--:|\n| clg | 12.5 |\n| farnebäck | – |\n");
}

TEST(DataTable, QuotesAndLeavesNothingForNaN) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const DataTable table{
      "d",
      {"a", "b", "c"},
      {{std::string("x,\"y\""), 0.1, std::uint64_t{7}}, {std::string("z"), nan, std::uint64_t{0}}}};
  EXPECT_EQ(to_csv(table), "a,b,c\n\"x,\"\"y\"\"\",0.1,7\nz,,0\n");
  EXPECT_EQ(json_of(table).dump(), R"([{"a":"x,\"y\"","b":0.1,"c":7},{"a":"z","b":null,"c":0}])");
}

TEST(RangeMeans, CountsWhatHasTruthAndAverageWhatHasAnAnswer) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const cv::Mat truth = (cv::Mat_<float>(2, 3) << 1, 5, nan, 3, 9, 30);
  DepthImage depth{{}, 1, (cv::Mat_<float>(2, 3) << 1.5, nan, 2, 2, 25, 31), {}, {}};
  RangeMeans means;
  means.add(depth, truth, 20, 1);
  EXPECT_EQ(means.truth, (std::array<std::uint64_t, range_count>{2, 1, 1, 0, 1}));
  EXPECT_EQ(means.pixels,
            (std::array<std::uint64_t, range_count>{2, 0, 0, 0, 0}));  // 25 m and 31 m are beyond 20 m
  EXPECT_DOUBLE_EQ(means.mean(0), 0.75);
  EXPECT_TRUE(std::isnan(means.mean(1)));
  EXPECT_EQ(means.coverage(1), 0);
}

TEST(RangeMeans, ComparesOnlyWhereBothAnswer) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const cv::Mat truth = (cv::Mat_<float>(2, 2) << 1, 1, 1, 1);
  const DepthImage fine{{}, 1, (cv::Mat_<float>(2, 2) << 2, 3, nan, 5), {}, {}};
  const DepthImage rival{{}, 1, (cv::Mat_<float>(2, 2) << 1, nan, 1, 1), {}, {}};
  RangeMeans means;
  means.add(fine, truth, 20, 1, &rival);
  EXPECT_EQ(means.pixels[0], 2U);
  EXPECT_DOUBLE_EQ(means.mean(0), (1.0 + 4.0) / 2);
  RangeMeans coarse;  // a window of two stands for its four pixels
  coarse.add({{}, 2, (cv::Mat_<float>(1, 1) << 4), {}, {}}, truth, 20, 1, &rival);
  EXPECT_EQ(coarse.pixels[0], 3U);
  EXPECT_DOUBLE_EQ(coarse.mean(0), 3);
}

}  // namespace
}  // namespace pade::evaluation
