#include "pade/io/sequence/trajectory.hpp"

#include <cmath>
#include <random>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "io/sequence/flight_folders.hpp"
#include "support/temporary_folder.hpp"

namespace pade::io {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

/// Level flight round a circle of 3 m radius with the nose along the path: a constant body twist, so that
/// every pose in between is known exactly.
Pose on_circle(double seconds) {
  const double angle = 0.7 * seconds;
  return {Eigen::Quaterniond(Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitZ())),
          {3 * std::sin(angle), 3 - 3 * std::cos(angle), 2}};
}

Trajectory circle_rows(double step, int count) {
  std::vector<StampedPose> rows;
  for (int i = 0; i < count; ++i) rows.push_back({Time::from_seconds(i * step), on_circle(i * step)});
  return Trajectory(rows);
}

TEST(Trajectory, BetweenRowsAFlightRoundACircleStaysOnTheCircle) {
  const Trajectory rows = circle_rows(0.4, 6);
  for (double seconds = 0; seconds <= 2.0; seconds += 0.013) {
    const auto pose = rows.at(Time::from_seconds(seconds), 0.5);
    ASSERT_TRUE(pose) << seconds;
    EXPECT_LT((pose->translation - on_circle(seconds).translation).norm(), 1e-8) << seconds;
    EXPECT_LT(test::rotation_difference(*pose, on_circle(seconds)), 1e-8) << seconds;
  }
}

TEST(Trajectory, NothingIsExtrapolated) {
  const Trajectory rows = circle_rows(0.4, 6);
  EXPECT_FALSE(rows.at(Time::from_seconds(-0.001), 0.5));
  const auto late = rows.at(Time::from_seconds(2.001), 0.5);
  ASSERT_FALSE(late);
  EXPECT_THAT(late.error().message, HasSubstr("cover 0.000000 to 2.000000"));
}

TEST(Trajectory, AStampRoundedToTheMicrosecondStillMeetsItsRow) {
  const Trajectory rows({{Time{1'000'000'400}, on_circle(1)}, {Time{2'000'000'600}, on_circle(2)}});
  EXPECT_TRUE(rows.at(Time{1'000'000'000}, 0));
  EXPECT_TRUE(rows.at(Time{2'000'001'000}, 0));
}

TEST(Trajectory, AGapLargerThanAllowedIsNotBridged) {
  const Trajectory rows = circle_rows(0.4, 6);
  EXPECT_TRUE(rows.at(Time::from_seconds(0.2), 0.41));
  const auto pose = rows.at(Time::from_seconds(0.2), 0.39);
  ASSERT_FALSE(pose);
  EXPECT_THAT(pose.error().message, HasSubstr("gap of 0.400 s"));
  EXPECT_TRUE(rows.at(Time::from_seconds(0.4), 0.0)) << "a row itself needs no interpolation";
}

Result<Trajectory> parse(const std::string& text, ReadReport& report) {
  return parse_trajectory(text, "poses.txt", report);
}

TEST(PoseFile, ReadsTheTumConventionOfScalarLastQuaternions) {
  ReadReport report;
  const auto rows = parse(
      "# comment\n1305031102.175304 1 2 3 0 0 0.70710678 0.70710678\r\n\n2000000000,4,5,6,0,0,0,1\n", report);
  ASSERT_TRUE(rows);
  ASSERT_THAT(rows->rows(), SizeIs(2));
  EXPECT_THAT(report.skipped, IsEmpty());
  EXPECT_EQ(rows->rows()[0].time.nanoseconds, 1305031102175304000);
  EXPECT_EQ(rows->rows()[0].pose.translation, Eigen::Vector3d(1, 2, 3));
  // A quarter turn about z takes x to y.
  EXPECT_LT((rows->rows()[0].pose.rotation * Eigen::Vector3d::UnitX() - Eigen::Vector3d::UnitY()).norm(),
            1e-9);
  EXPECT_NEAR(rows->rows()[0].pose.rotation.norm(), 1, 1e-15);
}

TEST(PoseFile, SurvivesTheRoundTripToTheLastBit) {
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  std::vector<StampedPose> rows;
  for (int i = 0; i < 50; ++i) {
    rows.push_back({Time{1'700'000'000'123'456'789 + 33'333'333LL * i},
                    {rotation_exp({normal(random), normal(random), normal(random)}),
                     {normal(random), 1e-7 * normal(random), 1e6 * normal(random)}}});
  }
  ReadReport report;
  const auto back = parse(format_trajectory(rows), report);
  ASSERT_TRUE(back);
  ASSERT_EQ(back->size(), rows.size());
  for (std::size_t i = 0; i < rows.size(); ++i) {
    EXPECT_EQ(back->rows()[i].time, rows[i].time);
    EXPECT_EQ(back->rows()[i].pose.translation, rows[i].pose.translation);
    EXPECT_LT((back->rows()[i].pose.rotation.coeffs() - rows[i].pose.rotation.coeffs()).norm(), 1e-15);
  }
}

struct BadRow {
  const char* name;
  const char* row;
  const char* reason;
};

class BadPoseRow : public testing::TestWithParam<BadRow> {};

TEST_P(BadPoseRow, IsSkippedWithItsLineAndTheOthersAreKept) {
  ReadReport report;
  const auto rows = parse(
      fmt::format("# t x y z qx qy qz qw\n1 0 0 0 0 0 0 1\n{}\n3 1 0 0 0 0 0 1\n", GetParam().row), report);
  ASSERT_TRUE(rows);
  EXPECT_THAT(rows->rows(), SizeIs(2));
  ASSERT_THAT(report.skipped, SizeIs(1));
  EXPECT_EQ(report.skipped[0].file, "poses.txt");
  EXPECT_THAT(report.skipped[0].reason, HasSubstr("line 3: "));
  EXPECT_THAT(report.skipped[0].reason, HasSubstr(GetParam().reason));
}

TEST_P(BadPoseRow, RefusesAFileThatHoldsNothingElse) {
  ReadReport report;
  const auto rows = parse(fmt::format("{0}\n{0}\n", GetParam().row), report);
  if (std::string(GetParam().name) == "DuplicateTime") {
    EXPECT_TRUE(rows) << "the first of two rows with one time is good";
    return;
  }
  ASSERT_FALSE(rows);
  EXPECT_THAT(rows.error().message, HasSubstr("poses.txt: no usable pose in 2 rows"));
  EXPECT_THAT(rows.error().message, HasSubstr(GetParam().reason));
}

INSTANTIATE_TEST_SUITE_P(Kinds, BadPoseRow,
                         testing::Values(BadRow{"NanPosition", "2 nan 0 0 0 0 0 1", "not finite"},
                                         BadRow{"NanQuaternion", "2 0 0 0 NaN 0 0 1", "not finite"},
                                         BadRow{"InfinitePosition", "2 0 inf 0 0 0 0 1", "not finite"},
                                         BadRow{"OverflowingPosition", "2 0 1e999 0 0 0 0 1", "not finite"},
                                         BadRow{"ZeroQuaternion", "2 0 0 0 0 0 0 0", "quaternion is zero"},
                                         BadRow{"LongQuaternion", "2 0 0 0 0 0 0 2", "norm 2"},
                                         BadRow{"ShortQuaternion", "2 0 0 0 0.5 0.5 0.5 0.4",
                                                "norm 0.953939"},
                                         BadRow{"MissingColumn", "2 0 0 0 0 0 1", "found 7 fields"},
                                         BadRow{"ExtraColumn", "2 0 0 0 0 0 0 1 5", "found 9 fields"},
                                         BadRow{"Text", "2 0 0 zero 0 0 0 1", "found \"zero\""},
                                         BadRow{"TextAsTime", "now 0 0 0 0 0 0 1", "found time \"now\""},
                                         BadRow{"NanTime", "nan 0 0 0 0 0 0 1", "found time"},
                                         BadRow{"DuplicateTime", "1 9 9 9 0 0 0 1", "seen before"}),
                         [](const auto& kind) { return std::string(kind.param.name); });

TEST(PoseFile, OfTwoRowsWithOneTimeTheFirstCounts) {
  ReadReport report;
  const auto rows = parse("1 5 0 0 0 0 0 1\n1 9 9 9 0 0 0 1\n2 0 0 0 0 0 0 1\n", report);
  ASSERT_TRUE(rows);
  EXPECT_EQ(rows->rows()[0].pose.translation.x(), 5);
}

TEST(PoseFile, UnsortedRowsAreSortedAndReported) {
  ReadReport report;
  const auto rows = parse("3 3 0 0 0 0 0 1\n1 1 0 0 0 0 0 1\n2 2 0 0 0 0 0 1\n", report);
  ASSERT_TRUE(rows);
  std::vector<double> x;
  for (const auto& row : rows->rows()) x.push_back(row.pose.translation.x());
  EXPECT_THAT(x, ElementsAre(1, 2, 3));
  EXPECT_THAT(report.skipped, IsEmpty());
  EXPECT_THAT(report.notes, ElementsAre(HasSubstr("have been sorted")));
}

TEST(PoseFile, AnEmptyOrMissingFileIsRefusedByName) {
  const test::TemporaryFolder folder;
  ReadReport report;
  test::write_text(folder / "empty.txt", "# nothing\n");
  const auto empty = read_trajectory(folder / "empty.txt", report);
  ASSERT_FALSE(empty);
  EXPECT_THAT(empty.error().message, HasSubstr("empty.txt: no usable pose in 0 rows (it is empty)"));
  const auto missing = read_trajectory(folder / "missing.txt", report);
  ASSERT_FALSE(missing);
  EXPECT_THAT(missing.error().message, HasSubstr("missing.txt: no such file"));
  const auto directory = read_trajectory(folder.path(), report);
  ASSERT_FALSE(directory);
  EXPECT_THAT(directory.error().message, HasSubstr("is a folder"));
}

}  // namespace
}  // namespace pade::io
