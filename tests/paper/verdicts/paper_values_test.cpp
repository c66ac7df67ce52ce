// The paper's tables agree with themselves and with what its text says of them.
#include "pade/paper/verdicts/paper_values.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include <gtest/gtest.h>

namespace pade::evaluation {
namespace {

constexpr std::array kFlows = {PaperFlow::clg, PaperFlow::farneback, PaperFlow::lucas_kanade};

double error(std::string_view method, PaperFlow flow, std::size_t range) {
  return paper_errors(method, flow).value().ranges[range].mean;
}

TEST(PaperTables, HaveEveryMethodWithEveryFlow) {
  for (const std::string_view method : {paper_ttc, paper_pade}) {
    for (const PaperFlow flow : kFlows) {
      EXPECT_TRUE(paper_errors(method, flow) && paper_time(method, flow)) << method << " " << name_of(flow);
    }
  }
  EXPECT_FALSE(paper_errors("stereo", PaperFlow::clg));
}

TEST(PaperTable1, SaysWhatSection31SaysOfIt) {
  // "Lucas-Kanade provides the lowest average error in the 0-8 meter range."
  for (const std::string_view method : {paper_ttc, paper_pade}) {
    for (const std::size_t range : {0, 1}) {
      for (const PaperFlow flow : {PaperFlow::clg, PaperFlow::farneback})
        EXPECT_LT(error(method, PaperFlow::lucas_kanade, range), error(method, flow, range));
    }
  }
  // "Inseparable" at 0-4 m, and at 4-8 m the difference grows in favour of PADE.
  for (const PaperFlow flow : {PaperFlow::farneback, PaperFlow::lucas_kanade}) {
    const double near = error(paper_ttc, flow, 0) - error(paper_pade, flow, 0);
    const double next = error(paper_ttc, flow, 1) - error(paper_pade, flow, 1);
    EXPECT_LE(std::abs(near), 0.0201) << name_of(flow);
    EXPECT_GT(next, 0.3) << name_of(flow);
  }
}

TEST(PaperTable1, HasTtcAheadWhereTheAbstractSaysPade) {
  EXPECT_LT(error(paper_ttc, PaperFlow::farneback, 0), error(paper_pade, PaperFlow::farneback, 0));
  EXPECT_LT(error(paper_ttc, PaperFlow::lucas_kanade, 0), error(paper_pade, PaperFlow::lucas_kanade, 0));
  for (const PaperFlow flow : kFlows) EXPECT_LT(error(paper_ttc, flow, 3), error(paper_pade, flow, 3));
}

TEST(PaperTable2, AddsUp) {
  for (const PaperTime& row : paper_table2) {
    EXPECT_EQ(row.flow_ms + row.depth_ms, row.total_ms) << row.method << " " << name_of(row.flow);
    EXPECT_NEAR(row.frames_per_second, 1000 / row.total_ms, 0.011) << row.method << " " << name_of(row.flow);
  }
}

TEST(PaperTable2, SaysWhatSection33SaysOfIt) {
  const double share = paper_time(paper_pade, PaperFlow::farneback)->flow_ms /
                       paper_time(paper_pade, PaperFlow::lucas_kanade)->flow_ms;
  EXPECT_NEAR(share, paper_farneback_share, 0.006);
  const auto fastest =
      std::min_element(paper_table2.begin(), paper_table2.end(),
                       [](const PaperTime& a, const PaperTime& b) { return a.total_ms < b.total_ms; });
  EXPECT_EQ(fastest->method, paper_pade);
  EXPECT_EQ(fastest->flow, PaperFlow::farneback);
}

TEST(PaperFlows, AreFoundByOurNames) {
  EXPECT_EQ(paper_flow("clg-fast-half"), PaperFlow::clg);
  EXPECT_EQ(paper_flow("farneback"), PaperFlow::farneback);
  EXPECT_EQ(paper_flow("lucas-kanade-half"), PaperFlow::lucas_kanade);
  for (const char* other : {"dis-medium", "opencv-farneback", ""}) EXPECT_FALSE(paper_flow(other)) << other;
}

}  // namespace
}  // namespace pade::evaluation
