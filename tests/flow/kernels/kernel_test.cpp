#include <cstring>
#include <map>
#include <vector>

#include <gtest/gtest.h>

#include "flow/kernels/kernel_twins.hpp"

namespace pade::flow {
namespace {

using simd::InstructionSet;

class FlowKernels : public ::testing::TestWithParam<InstructionSet> {};

/// Run once for each instruction set: the scalar twins take seconds.
const std::vector<testing::TwinResult>& twins_of(InstructionSet set) {
  static std::map<InstructionSet, std::vector<testing::TwinResult>> known;
  const auto found = known.find(set);
  return found != known.end() ? found->second
                              : known.emplace(set, testing::run_kernel_twins(set)).first->second;
}

TEST_P(FlowKernels, AgreeWithTheirScalarTwinsInWholeImagesAndInStrips) {
  if (!simd::available(GetParam(), simd::best()))
    GTEST_SKIP() << "this machine has no " << simd::name(GetParam());
  for (const testing::TwinResult& twin : twins_of(GetParam())) {
    EXPECT_LT(twin.largest_difference, 1e-4) << twin.kernel;
    EXPECT_TRUE(twin.strips_agree) << twin.kernel;
  }
}

TEST_P(FlowKernels, GiveTheSameBitsInEveryInstructionSet) {
  if (!simd::available(GetParam(), simd::best()))
    GTEST_SKIP() << "this machine has no " << simd::name(GetParam());
  const auto& expected = twins_of(InstructionSet::baseline);
  const auto& found = twins_of(GetParam());
  ASSERT_EQ(found.size(), expected.size());
  for (std::size_t i = 0; i < found.size(); ++i) {
    ASSERT_EQ(found[i].values.size(), expected[i].values.size());
    EXPECT_EQ(std::memcmp(found[i].values.data(), expected[i].values.data(), 4 * found[i].values.size()), 0)
        << found[i].kernel;
  }
}

INSTANTIATE_TEST_SUITE_P(InstructionSets, FlowKernels,
                         ::testing::Values(InstructionSet::baseline, InstructionSet::avx2,
                                           InstructionSet::avx512),
                         [](const auto& set) { return std::string(simd::name(set.param)); });

}  // namespace
}  // namespace pade::flow
