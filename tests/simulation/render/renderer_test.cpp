#include "pade/simulation/render/renderer.hpp"

#include <cmath>
#include <set>

#include <gtest/gtest.h>

namespace pade::simulation {
namespace {

TEST(SamplePattern, UsesEachRowAndColumnOnceAndIsMirroredAboutTheCentre) {
  for (int samples = 1; samples <= 16; ++samples) {
    const auto offsets = sample_pattern(samples);
    ASSERT_EQ(offsets.size(), static_cast<std::size_t>(samples));
    std::set<int> columns;
    std::set<int> rows;
    for (const Eigen::Vector2d& at : offsets) {
      columns.insert(static_cast<int>(std::lround((at.x() + 0.5) * samples - 0.5)));
      rows.insert(static_cast<int>(std::lround((at.y() + 0.5) * samples - 0.5)));
    }
    EXPECT_EQ(columns.size(), offsets.size()) << samples;
    EXPECT_EQ(rows.size(), offsets.size()) << samples;
    for (std::size_t i = 0; i < offsets.size(); ++i)
      EXPECT_LT((offsets[i] + offsets[offsets.size() - 1 - i]).norm(), 1e-12) << samples;
  }
}

}  // namespace
}  // namespace pade::simulation
