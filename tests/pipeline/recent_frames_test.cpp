// Which of the last frames are looked at beside the newest.
#include "pade/pipeline/recent_frames.hpp"

#include <cmath>
#include <vector>

#include <gtest/gtest.h>

namespace pade {
namespace {

Frame frame_at(double x) {
  Frame frame;
  frame.T_world_camera.translation.x() = x;
  return frame;
}

std::vector<int> views_of(const std::vector<double>& way, int count = 4, int step = 1) {
  RecentFrames recent;
  for (std::size_t i = 0; i + 1 < way.size(); ++i) recent.push({frame_at(way[i]), {}}, 64);
  return recent.views(frame_at(way.back()), count, 16, step);
}

TEST(Views, DoubleTheirBaselinesOnAStraightWay) {
  std::vector<double> way;
  for (int i = 0; i < 20; ++i) way.push_back(0.1 * i);
  EXPECT_EQ(views_of(way), (std::vector<int>{2, 4, 8, 16}));
}

TEST(Views, AreOfTheLongestBaselineWhereTheCameraTurnsBack) {
  // Out and back again: the frame of sixteen before stands where the newest does.
  std::vector<double> way;
  for (int i = 0; i <= 8; ++i) way.push_back(0.1 * i);
  for (int i = 7; i >= 0; --i) way.push_back(0.1 * i);
  const std::vector<int> views = views_of(way);
  ASSERT_FALSE(views.empty());
  EXPECT_EQ(views.back(), 8);
  double longest = 0;
  for (std::size_t i = 0; i + 1 < way.size(); ++i) longest = std::max(longest, std::abs(way[i] - way.back()));
  EXPECT_DOUBLE_EQ(std::abs(way[way.size() - 1 - 8] - way.back()), longest);
  EXPECT_GE(views.size(), 3U);
}

TEST(Views, AreOfOneChainOfFramesOnly) {
  std::vector<double> way;
  for (int i = 0; i < 20; ++i) way.push_back(0.1 * i);
  for (const int view : views_of(way, 4, 3)) EXPECT_EQ(view % 3, 0);
  EXPECT_EQ(views_of(way, 4, 3).back(), 15);
}

TEST(Views, AreNoneOfACameraThatStands) { EXPECT_TRUE(views_of(std::vector<double>(10, 1.0)).empty()); }

TEST(OverMissed, IsOfAMotionThatIsAllOfThem) {
  const Matrix6d one = Matrix6d::Identity() * 0.01;
  EXPECT_EQ(over_missed(one, 0), one);
  EXPECT_TRUE(over_missed(one, 2).isApprox(9 * one));
}

}  // namespace
}  // namespace pade
