#include "pade/depth/focus_of_expansion.hpp"

#include <Eigen/LU>
#include <gtest/gtest.h>

#include "pade/core/random.hpp"

namespace pade::depth {
namespace {

/// Flow that expands from `focus`, with noise and a share of vectors of a moving object.
std::vector<FlowSample> expanding(const Eigen::Vector2d& focus, double noise, double outliers,
                                  std::uint64_t seed) {
  Random random(seed);
  std::vector<FlowSample> samples;
  for (int i = 0; i < 4000; ++i) {
    const Eigen::Vector2d p(random.uniform(-320, 320), random.uniform(-240, 240));
    Eigen::Vector2d d = 0.2 / random.uniform(3, 15) * (p - focus);
    if (random.uniform() < outliers) d = {6, 1};
    samples.push_back({p, d + noise * Eigen::Vector2d(random.normal(), random.normal())});
  }
  return samples;
}

TEST(FocusOfExpansion, NoiseFreeFlowMeetsInOnePoint) {
  for (const Eigen::Vector2d& focus :
       {Eigen::Vector2d(0, 0), Eigen::Vector2d(120, -60), Eigen::Vector2d(-700, 300)}) {
    const auto found = focus_of_expansion(expanding(focus, 0, 0, 1), 2400);
    ASSERT_TRUE(found);
    EXPECT_LT((found->position - focus).norm(), 1e-3);
  }
}

TEST(FocusOfExpansion, ItsErrorHasTheStatedCovariance) {
  const Eigen::Vector2d focus(60, 20);
  double sum = 0;
  constexpr int kDraws = 100;
  for (std::uint64_t seed = 0; seed < kDraws; ++seed) {
    const auto found = focus_of_expansion(expanding(focus, 0.3, 0, seed), 2400);
    ASSERT_TRUE(found);
    EXPECT_NEAR(found->flow_sigma, 0.3, 0.03);
    const Eigen::Vector2d error = found->position - focus;
    sum += error.dot(found->covariance.inverse() * error);
  }
  EXPECT_NEAR(sum / kDraws, 2, 1.0);  // chi-square of two degrees of freedom
}

TEST(FocusOfExpansion, AThirdOfTheVectorsMayBelongToAMovingObject) {
  const Eigen::Vector2d focus(30, -40);
  const auto found = focus_of_expansion(expanding(focus, 0.2, 0.33, 3), 2400);
  ASSERT_TRUE(found);
  EXPECT_LT((found->position - focus).norm(), 3);
}

TEST(FocusOfExpansion, ParallelFlowHasNone) {
  Random random(2);
  for (const double noise : {0.0, 0.2}) {
    std::vector<FlowSample> samples;
    for (int i = 0; i < 2000; ++i) {
      samples.push_back({{random.uniform(-320, 320), random.uniform(-240, 240)},
                         {-10 / random.uniform(1, 5) + noise * random.normal(), noise * random.normal()}});
    }
    EXPECT_FALSE(focus_of_expansion(samples, 2400));
  }
  EXPECT_FALSE(focus_of_expansion({}, 2400));
}

}  // namespace
}  // namespace pade::depth
