#include "pade/io/sequence/dialects/pose_dialects.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <opencv2/imgcodecs.hpp>

#include "pade/io/sequence/sequence.hpp"

#include "io/sequence/flight_folders.hpp"
#include "support/temporary_folder.hpp"

namespace pade::io {
namespace {

using testing::Contains;
using testing::HasSubstr;

/// The poses of the test flight in one dialect.
struct Dialect {
  const char* name;
  const char* heading;
  /// time in nanoseconds, and the pose
  std::string (*row)(std::int64_t, const Pose&);
};

std::string kitti(std::int64_t, const Pose& pose) {
  const Eigen::Matrix3d R = pose.matrix3();
  std::string text;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) text += fmt::format("{:.17g} ", R(i, j));
    text += fmt::format("{:.17g}{}", pose.translation[i], i < 2 ? " " : "\n");
  }
  return text;
}

const Dialect kDialects[] = {
    {"Tum", "# t x y z\n",
     [](std::int64_t t, const Pose& p) { return test::pose_row(to_string(Time{t}), p); }},
    {"TumWithMoreColumns", "",
     [](std::int64_t t, const Pose& p) {
       std::string row = test::pose_row(to_string(Time{t}), p);
       row.back() = ' ';
       return row + "0.1 0.2\n";
     }},
    {"NanosecondsWithBlanks", "",
     [](std::int64_t t, const Pose& p) { return test::pose_row(fmt::format("{}", t), p); }},
    {"MicrosecondsSinceTheStart", "",
     [](std::int64_t t, const Pose& p) { return test::pose_row(fmt::format("{}", t / 1000), p); }},
    {"Euroc", "", [](std::int64_t t, const Pose& p) { return test::euroc_row(Time{t}, p, ""); }},
    {"EurocWithVelocities",
     "#timestamp [ns], p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x [], q_RS_y [], q_RS_z [], "
     "v_x\n",
     [](std::int64_t t, const Pose& p) { return test::euroc_row(Time{t}, p, ",0.5"); }},
    {"NamedColumns", "timestamp,qw,qx,qy,qz,x,y,z\n",
     [](std::int64_t t, const Pose& p) {
       const auto& q = p.rotation;
       const auto& x = p.translation;
       return fmt::format("{},{:.17g},{:.17g},{:.17g},{:.17g},{:.17g},{:.17g},{:.17g}\n", to_string(Time{t}),
                          q.w(), q.x(), q.y(), q.z(), x.x(), x.y(), x.z());
     }},
    {"Kitti", "", kitti},
    {"WithoutTime", "",
     [](std::int64_t, const Pose& p) {
       const std::string row = test::pose_row("0", p);
       return row.substr(2);
     }},
};

class PoseDialects : public testing::TestWithParam<Dialect> {};

TEST_P(PoseDialects, GiveTheSamePosesInATumFolder) {
  const test::TemporaryFolder folder;
  const test::Flight flight = test::make_flight();
  test::write_tum(folder.path(), flight);
  std::string text = GetParam().heading;
  for (std::size_t i = 0; i < flight.size(); ++i) {
    text += GetParam().row(flight.times[i].nanoseconds, flight.T_world_camera[i]);
  }
  test::write_text(folder / "poses.any", text);
  SequenceOptions options;
  options.poses = (folder / "poses.any").string();
  const auto sequence = Sequence::open(folder.path(), options);
  ASSERT_TRUE(sequence) << sequence.error().message;
  ASSERT_EQ(sequence->size(), flight.size());
  for (std::size_t i = 0; i < flight.size(); ++i) {
    EXPECT_LT((sequence->pose(i).translation - flight.T_world_camera[i].translation).norm(), 1e-9);
    EXPECT_LT(test::rotation_difference(sequence->pose(i), flight.T_world_camera[i]), 1e-7);
  }
}

INSTANTIATE_TEST_SUITE_P(Of, PoseDialects, testing::ValuesIn(kDialects),
                         [](const auto& instance) { return std::string(instance.param.name); });

TEST(PoseDialect, SaysWhatItMadeOfStampsAndColumns) {
  ReadReport report;
  const auto read = parse_any_poses(
      "0 1 2 3 0 0 0 1 9\n100000000 1 2 3 0 0 0 1 9\n200000000 1 2 3 0 0 0 1 9\n", "p.txt", {}, report);
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(read->rows().back().time, Time::from_seconds(0.2));
  EXPECT_THAT(report.notes, Contains(HasSubstr("look like nanoseconds")));
  EXPECT_THAT(report.notes, Contains(HasSubstr("3 rows have more than 8 columns")));
}

TEST(PoseDialect, NamesTheLineOfWhatIsNone) {
  ReadReport report;
  const auto none = parse_any_poses("# nothing\nfoo bar\n1 2 3\n", "p.txt", {}, report);
  ASSERT_FALSE(none);
  EXPECT_THAT(none.error().message, HasSubstr("line 3: found 3 fields"));
}

TEST(ImageLists, HoldNamesWithBlanks) {
  for (const bool quoted : {false, true}) {
    const test::TemporaryFolder folder;
    const test::Flight flight = test::make_flight();
    test::write_tum(folder.path(), flight);
    std::filesystem::rename(folder / "rgb", folder / "my images");
    std::string list = "# timestamp filename\n";
    for (std::size_t i = 0; i < flight.size(); ++i) {
      const std::string name = "my images/" + flight.stamp(i) + ".png";
      list += flight.stamp(i) + " " + (quoted ? "\"" + name + "\"" : name) + "\n";
    }
    test::write_text(folder / "rgb.txt", list);
    const auto sequence = Sequence::open(folder.path());
    ASSERT_TRUE(sequence) << sequence.error().message;
    EXPECT_EQ(sequence->size(), flight.size());
  }
}

TEST(ImageLists, TellCameraFromDepthImagesInEitherOrder) {
  for (const bool by_name : {true, false}) {
    const test::TemporaryFolder folder;
    const test::Flight flight = test::make_flight();
    test::write_tum(folder.path(), flight);
    const std::string depth_folder = by_name ? "depth" : "range";
    std::string list;
    for (std::size_t i = 0; i < flight.size(); ++i) {
      cv::Mat depth(flight.camera.size(), CV_16UC1, cv::Scalar(2000));
      const std::string name = depth_folder + "/" + flight.stamp(i) + ".png";
      test::write_image(folder / name, depth);
      list += fmt::format("{0} {1} {0} rgb/{0}.png\n", flight.stamp(i), name);
    }
    test::write_text(folder / "associations.txt", list);
    std::filesystem::remove(folder / "rgb.txt");
    std::filesystem::remove(folder / "depth.txt");
    const auto sequence = Sequence::open(folder.path());
    ASSERT_TRUE(sequence) << sequence.error().message;
    EXPECT_EQ(sequence->size(), flight.size());
    EXPECT_EQ(sequence->intensity().bits, 8) << "the camera images, not the depth";
    const auto truth = sequence->truth(0);
    ASSERT_TRUE(truth) << truth.error().message;
    EXPECT_NEAR(truth->at<float>(24, 32), 2, 1e-6);
  }
}

TEST(ImageFolders, MayHaveOtherNames) {
  const test::TemporaryFolder folder;
  const test::Flight flight = test::make_flight();
  test::write_tum(folder.path(), flight);
  std::filesystem::remove(folder / "rgb.txt");
  std::filesystem::rename(folder / "rgb", folder / "images");
  const auto sequence = Sequence::open(folder.path());
  ASSERT_TRUE(sequence) << sequence.error().message;
  EXPECT_EQ(sequence->size(), flight.size());
}

}  // namespace
}  // namespace pade::io
