#include "pade/io/sequence/dialects/pose_dialects.hpp"

#include <functional>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pade/io/image/image_codec.hpp"
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

/// x y z and the quaternion in one order ("xyzw", "wxyz"), each behind the separator.
std::string values(const Pose& pose, std::string_view order, const std::string& separator) {
  std::string text;
  for (int i = 0; i < 3; ++i) text += separator + fmt::format("{:.17g}", pose.translation[i]);
  for (const char c : order) {
    const auto& q = pose.rotation;
    text += separator + fmt::format("{:.17g}", c == 'w'   ? q.w()
                                               : c == 'x' ? q.x()
                                               : c == 'y' ? q.y()
                                                          : q.z());
  }
  return text;
}

std::string with_commas(std::string text) {
  std::replace(text.begin(), text.end(), '.', ',');
  return text;
}

const Dialect kDialects[] = {
    {"RosEcho",
     "%time,field.header.seq,field.header.frame_id,field.pose.pose.position.x,field.pose.pose.position.y,"
     "field.pose.pose.position.z,field.pose.pose.orientation.x,field.pose.pose.orientation.y,"
     "field.pose.pose.orientation.z,field.pose.pose.orientation.w,field.twist.twist.linear.x\n",
     [](std::int64_t t, const Pose& p) { return fmt::format("{},7,map{},0\n", t, values(p, "xyzw", ",")); }},
    {"PlotJuggler",
     "__time,/odom/pose/position/x,/odom/pose/position/y,/odom/pose/position/z,/odom/pose/orientation/x,"
     "/odom/pose/orientation/y,/odom/pose/orientation/z,/odom/pose/orientation/w\n",
     [](std::int64_t t, const Pose& p) { return to_string(Time{t}) + values(p, "xyzw", ",") + "\n"; }},
    {"Px4", "timestamp,x,y,z,q[0],q[1],q[2],q[3]\n",
     [](std::int64_t t, const Pose& p) { return fmt::format("{}{}\n", t / 1000, values(p, "wxyz", ",")); }},
    {"Maplab",
     "timestamp [ns], vertex index, position x [m], position y [m], position z [m], quaternion x, quaternion "
     "y, "
     "quaternion z, quaternion w\n",
     [](std::int64_t t, const Pose& p) { return fmt::format("{}, 0{}\n", t, values(p, "xyzw", ", ")); }},
    {"OpenVins", "# timestamp(s) tx ty tz qx qy qz qw Pr11\n",
     [](std::int64_t t, const Pose& p) { return to_string(Time{t}) + values(p, "xyzw", " ") + " 0.1\n"; }},
    {"AirSim", "VehicleName\tTimeStamp [ms]\tPOS_X\tPOS_Y\tPOS_Z\tQ_W\tQ_X\tQ_Y\tQ_Z\tImageFile\n",
     [](std::int64_t t, const Pose& p) {
       return fmt::format("drone\t{}{}\ta.png\n", t / 1'000'000, values(p, "wxyz", "\t"));
     }},
    {"MillisecondsSince1970", "",
     [](std::int64_t t, const Pose& p) {
       return fmt::format("{}{}\n", t / 1'000'000, values(p, "xyzw", " "));
     }},
    {"SecondsAndNanoseconds", "secs,nsecs,x,y,z,qx,qy,qz,qw\n",
     [](std::int64_t t, const Pose& p) {
       return fmt::format("{},{}{}\n", t / 1'000'000'000, t % 1'000'000'000, values(p, "xyzw", ","));
     }},
    {"DecimalCommas", "time;x;y;z;qx;qy;qz;qw\n",
     [](std::int64_t t, const Pose& p) {
       return with_commas(to_string(Time{t}) + values(p, "xyzw", ";")) + "\n";
     }},
    {"DecimalCommasBetweenTabs", "",
     [](std::int64_t t, const Pose& p) {
       return with_commas(to_string(Time{t}) + values(p, "xyzw", "\t")) + "\n";
     }},
    {"Vins", "",
     [](std::int64_t t, const Pose& p) {
       return fmt::format("{}{},0.1,0.2,0.3,\n", t, values(p, "wxyz", ","));
     }},
    {"TimeAndMatrix", "",
     [](std::int64_t t, const Pose& p) { return to_string(Time{t}) + " " + kitti(t, p); }},
    {"TimeAndWholeMatrix", "",
     [](std::int64_t t, const Pose& p) {
       std::string row = to_string(Time{t}) + " " + kitti(t, p);
       row.back() = ' ';
       return row + "0 0 0 1\n";
     }},
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

TEST(PoseDialect, RefusesAHeadingThatItDoesNotUnderstand) {
  const auto message = [](const std::string& text) {
    ReadReport report;
    const auto read = parse_any_poses(text, "p.txt", {}, report);
    return read ? std::string("read") : read.error().message;
  };
  const std::string row = "0 47.1 8.2 400 0 0 0 1\n0.1 47.1 8.2 400 0 0 0 1\n";
  EXPECT_THAT(message("time lat lon alt qx qy qz qw\n" + row),
              testing::AllOf(HasSubstr("p.txt: line 1: found columns time, lat"), HasSubstr("gnss.csv")));
  EXPECT_THAT(message("# time lat lon alt qx qy qz qw\n" + row), HasSubstr("line 1: found columns"));
  EXPECT_THAT(message("time,x,y,z,roll,pitch,yaw\n0,1,2,3,0,0,0\n"),
              HasSubstr("angles must be made quaternions"));
  EXPECT_THAT(message("frame,x,y,z,qx,qy,qz,qw\n0,1,2,3,0,0,0,1\n"), HasSubstr("none of them a time"));
  EXPECT_THAT(message("#   IMAGE_ID, QW, QX, QY, QZ, TX, TY, TZ, CAMERA_ID, NAME\n1 1 0 0 0 1 2 3 1 a.png\n"),
              HasSubstr("COLMAP's images.txt"));
  EXPECT_THAT(message("1 0 0 1\n0 1 0 2\n0 0 1 3\n0 0 0 1\n"), HasSubstr("4x4 matrix over four lines"));
  for (const char* remark : {"# my notes, of a day, in May\n", "# poses of a flight through the old yard\n"})
    EXPECT_THAT(message(remark + row), "read") << "a remark is no heading";
}

TEST(PoseDialect, WondersAboutMilliseconds) {
  const auto far =
      Trajectory({{Time::from_seconds(0), {}}, {Time::from_seconds(100), {}}}).at(Time::from_seconds(3), 0.5);
  ASSERT_FALSE(far);
  EXPECT_THAT(far.error().message, HasSubstr("stamps in milliseconds?"));
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

/// Rows of an odometry that was recorded 80 ms after it was measured, with the columns of its stamp.
std::string echoed(const std::string& stamp_columns, const std::function<std::string(std::int64_t)>& stamp) {
  std::string text = "%time,field.header.seq," + stamp_columns +
                     ",field.pose.pose.position.x,field.pose.pose.position.y,field.pose.pose.position.z,"
                     "field.pose.pose.orientation.x,field.pose.pose.orientation.y,"
                     "field.pose.pose.orientation.z,field.pose.pose.orientation.w\n";
  for (std::int64_t i = 0; i < 5; ++i) {
    const std::int64_t measured = 1'500'000'000'123'456'789 + 100'000'000 * i;
    text += fmt::format("{},{},{},1,2,{},0,0,0,1\n", measured + 80'000'000, i, stamp(measured), i);
  }
  return text;
}

TEST(EchoedPoses, HaveTheTimesOfTheirHeaders) {
  const auto whole = [](std::int64_t t) { return fmt::format("{}", t); };
  const auto parted = [](std::int64_t t) {
    return fmt::format("{},{}", t / 1'000'000'000, t % 1'000'000'000);
  };
  for (const std::string& text :
       {echoed("field.header.stamp", whole), echoed("header.stamp.secs,header.stamp.nsecs", parted)}) {
    ReadReport report;
    const auto poses = parse_any_poses(text, "odom.csv", {}, report);
    ASSERT_TRUE(poses) << poses.error().message;
    ASSERT_EQ(poses->rows().size(), 5U);
    EXPECT_EQ(poses->rows()[1].time.nanoseconds, 1'500'000'000'223'456'789);
    EXPECT_THAT(report.notes, testing::Contains(HasSubstr("the times are those of the headers")));
  }
  ReadReport report;
  const auto zeros = [](std::int64_t) { return std::string("0"); };
  const auto poses = parse_any_poses(echoed("field.header.stamp", zeros), "odom.csv", {}, report);
  ASSERT_TRUE(poses) << poses.error().message;
  EXPECT_EQ(poses->rows()[1].time.nanoseconds, 1'500'000'000'303'456'789);
  EXPECT_THAT(report.notes, testing::Contains(HasSubstr("the headers have no stamps")));
}

}  // namespace
}  // namespace pade::io
