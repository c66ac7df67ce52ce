// Damaged input: what is refused, what is skipped, and what is said about it (docs/sequences.md).
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pade/io/sequence/sequence.hpp"

#include "io/sequence/flight_folders.hpp"
#include "support/temporary_folder.hpp"

namespace pade::io {
namespace {

namespace fs = std::filesystem;
using test::Flight;
using testing::AllOf;
using testing::ElementsAre;
using testing::Field;
using testing::HasSubstr;
using testing::IsEmpty;

auto skipped(const std::string& file, const std::string& reason) {
  return AllOf(Field(&Skipped::file, file), Field(&Skipped::reason, HasSubstr(reason)));
}

class DamagedSequence : public testing::Test {
 protected:
  test::TemporaryFolder folder_;
  const Flight flight_ = test::make_flight();

  void SetUp() override {
    test::write_tum(folder_.path(), flight_);
    testing::internal::CaptureStderr();
  }
  void TearDown() override {
    EXPECT_THAT(testing::internal::GetCapturedStderr(), IsEmpty())
        << "libraries must not write to the terminal";
  }

  [[nodiscard]] std::filesystem::path rgb(std::size_t i) const {
    return test::rgb_file(folder_.path(), flight_, i);
  }
  [[nodiscard]] std::string rgb_name(std::size_t i) const { return "rgb/" + flight_.stamp(i) + ".png"; }
  void cut_short(std::size_t i) const {
    const std::string bytes = test::read_bytes(rgb(i));
    test::write_text(rgb(i), bytes.substr(0, bytes.size() / 2));
  }
  /// Writes groundtruth.txt with row i replaced.
  void replace_pose(std::size_t i, const std::string& row) const {
    std::string text;
    for (std::size_t k = 0; k < flight_.size(); ++k) {
      text += k == i ? row + "\n" : test::pose_row(flight_.stamp(k), flight_.T_world_camera[k]);
    }
    test::write_text(folder_ / "groundtruth.txt", text);
  }

  /// One frame is skipped for `reason`; the others are all there; strict refuses.
  void expect_skipped_frame(std::size_t i, const std::string& reason) {
    const auto sequence = Sequence::open(folder_.path());
    ASSERT_TRUE(sequence) << sequence.error().message;
    EXPECT_EQ(sequence->size(), flight_.size() - 1);
    EXPECT_EQ(sequence->listed_frames(), flight_.size());
    EXPECT_THAT(sequence->skipped(), ElementsAre(skipped(rgb_name(i), reason)));
    for (std::size_t k = 0; k < sequence->size(); ++k) {
      EXPECT_EQ(sequence->time(k), flight_.times[k < i ? k : k + 1]);
      EXPECT_TRUE(sequence->frame(k));
    }
    expect_strict_refuses(reason);
  }
  void expect_strict_refuses(const std::string& reason) {
    SequenceOptions options;
    options.strict = true;
    const auto strict = Sequence::open(folder_.path(), options);
    ASSERT_FALSE(strict);
    EXPECT_THAT(strict.error().message, HasSubstr(reason));
    EXPECT_THAT(strict.error().message, HasSubstr("strict"));
  }
  void expect_refused(const std::vector<std::string>& parts) {
    const auto sequence = Sequence::open(folder_.path());
    ASSERT_FALSE(sequence);
    for (const auto& part : parts) EXPECT_THAT(sequence.error().message, HasSubstr(part));
  }
};

TEST_F(DamagedSequence, MissingFolderIsRefused) {
  const auto sequence = Sequence::open(folder_ / "nowhere");
  ASSERT_FALSE(sequence);
  EXPECT_EQ(sequence.error().message, (folder_ / "nowhere").string() + ": no such folder");
}

TEST_F(DamagedSequence, FileInPlaceOfAFolderIsRefused) {
  EXPECT_THAT(Sequence::open(folder_ / "camera.yaml").error().message,
              HasSubstr("is a file, expected the folder"));
}

TEST_F(DamagedSequence, FolderOfNoKnownLayoutIsRefused) {
  std::filesystem::create_directory(folder_ / "empty");
  EXPECT_THAT(Sequence::open(folder_ / "empty").error().message, HasSubstr("no known layout, expected rgb/"));
}

TEST_F(DamagedSequence, FolderWithoutImagesIsRefused) {
  std::filesystem::remove_all(folder_ / "rgb");
  std::filesystem::create_directory(folder_ / "rgb");
  expect_refused({"no images found"});
}

TEST_F(DamagedSequence, ImagesWhoseNamesAreNoTimesAreRefusedWithAnExample) {
  std::filesystem::remove_all(folder_ / "rgb");
  test::write_image(folder_.path() / "rgb" / "frame.png", flight_.images[0]);
  expect_refused({"no images found", "frame.png", "found name \"frame\", expected the time in seconds"});
}

TEST_F(DamagedSequence, PngCutShortIsSkipped) {
  cut_short(2);
  expect_skipped_frame(2, "the PNG is cut short");
}

TEST_F(DamagedSequence, EmptyImageIsSkipped) {
  test::write_text(rgb(0), "");
  expect_skipped_frame(0, "the file is empty (0 bytes)");
}

TEST_F(DamagedSequence, ImageThatIsListedButMissingIsSkipped) {
  std::string list;
  for (std::size_t i = 0; i < flight_.size(); ++i) list += flight_.stamp(i) + " " + rgb_name(i) + "\n";
  test::write_text(folder_ / "rgb.txt", list);
  std::filesystem::remove(rgb(5));
  expect_skipped_frame(5, "no such file");
}

TEST_F(DamagedSequence, ImageOfOddSizeIsSkipped) {
  test::write_image(rgb(3), flight_.images[3](cv::Rect(0, 0, 63, 48)));
  expect_skipped_frame(3, "the image has 63 x 48 pixels, expected 64 x 48");
}

TEST_F(DamagedSequence, ImageOfOtherDepthIsSkipped) {
  test::write_image(rgb(3), cv::Mat::ones(48, 64, CV_16UC1));
  expect_skipped_frame(3, "the image has 16 bits, expected 8");
}

TEST_F(DamagedSequence, TextInPlaceOfAnImageIsSkipped) {
  test::write_text(rgb(3), "not an image");
  expect_skipped_frame(3, "cannot be decoded");
}

TEST_F(DamagedSequence, TwoImagesOfOneTimeCountOnce) {
  std::string list;
  for (std::size_t i = 0; i < flight_.size(); ++i)
    list += flight_.stamp(i == 4 ? 3 : i) + " " + rgb_name(i) + "\n";
  test::write_text(folder_ / "rgb.txt", list);
  expect_skipped_frame(4, "was seen before");
}

TEST_F(DamagedSequence, UnsortedImageListIsSortedAndReported) {
  std::string list;
  for (std::size_t i = flight_.size(); i-- > 0;) list += flight_.stamp(i) + " " + rgb_name(i) + "\n";
  test::write_text(folder_ / "rgb.txt", list);
  SequenceOptions options;
  options.strict = true;
  const auto sequence = Sequence::open(folder_.path(), options);
  ASSERT_TRUE(sequence) << sequence.error().message;
  for (std::size_t i = 0; i < flight_.size(); ++i) EXPECT_EQ(sequence->time(i), flight_.times[i]);
  EXPECT_THAT(sequence->notes(), ElementsAre(HasSubstr("have been sorted")));
}

TEST_F(DamagedSequence, NamesThatAreTimesSortAsNumbers) {
  // As text "10.1" comes before "2.9", "9" and "09.5".
  const test::TemporaryFolder here;
  const std::vector<std::string> names = {"2.9", "9", "09.5", "10.1", "100.000000"};
  std::string poses;
  for (std::size_t i = 0; i < names.size(); ++i) {
    test::write_image(here / "rgb" / (names[i] + ".png"), flight_.images[i]);
    poses += test::pose_row(names[i], flight_.T_world_camera[i]);
  }
  test::write_text(here / "groundtruth.txt", poses);
  test::write_text(here / "camera.yaml", test::camera_yaml(flight_.camera));
  const auto sequence = Sequence::open(here.path());
  ASSERT_TRUE(sequence) << sequence.error().message;
  ASSERT_EQ(sequence->size(), names.size());
  for (std::size_t i = 0; i < names.size(); ++i) EXPECT_EQ(sequence->image_file(i).stem(), names[i]);
  EXPECT_THAT(sequence->notes(), testing::IsEmpty());
}

TEST_F(DamagedSequence, LineOfTheImageListWithoutATimeIsSkipped) {
  std::string list = "yesterday rgb/1.png\n";
  for (std::size_t i = 0; i < flight_.size(); ++i) list += flight_.stamp(i) + " " + rgb_name(i) + "\n";
  test::write_text(folder_ / "rgb.txt", list);
  const auto sequence = Sequence::open(folder_.path());
  ASSERT_TRUE(sequence) << sequence.error().message;
  EXPECT_EQ(sequence->size(), flight_.size());
  EXPECT_THAT(sequence->skipped(), ElementsAre(skipped("rgb.txt", "line 1: found \"yesterday rgb/1.png\"")));
}

TEST_F(DamagedSequence, HalfOfTheFramesBadIsToleratedAndOneMoreIsNot) {
  for (const std::size_t i : {0, 2, 4}) cut_short(i);
  const auto half = Sequence::open(folder_.path());
  ASSERT_TRUE(half) << half.error().message;
  EXPECT_EQ(half->size(), 3U);
  cut_short(5);
  expect_refused({"4 of 6 frames unusable, expected at most half", "cut short"});
}

TEST_F(DamagedSequence, OneUsableFrameIsNoFlight) {
  std::filesystem::remove(rgb(1));
  for (const std::size_t i : {2, 3, 4, 5}) std::filesystem::remove(rgb(i));
  expect_refused({"1 of 1 frames usable, expected at least 2"});
}

TEST_F(DamagedSequence, FramesThatAreOnlyFoundCorruptWhenDecodedCountToo) {
  for (const std::size_t i : {1, 2, 3}) {
    std::string bytes = test::read_bytes(rgb(i));
    bytes[bytes.size() / 2] = static_cast<char>(bytes[bytes.size() / 2] ^ 1);
    test::write_text(rgb(i), bytes);
  }
  cut_short(0);
  const auto sequence = Sequence::open(folder_.path());
  ASSERT_TRUE(sequence) << sequence.error().message;
  std::size_t undecodable = 0;
  for (std::size_t i = 0; i < sequence->size(); ++i) {
    const auto frame = sequence->frame(i);
    if (frame) continue;
    ++undecodable;
    EXPECT_THAT(frame.error().message, HasSubstr("wrong checksum"));
  }
  EXPECT_EQ(undecodable, 3U);
  EXPECT_TRUE(sequence->check(2)) << "1 + 2 of 6 is half";
  EXPECT_THAT(sequence->check(3).error().message, HasSubstr("4 of 6 frames unusable"));
}

TEST_F(DamagedSequence, PoseRowWithNanIsSkippedAndItsFrameInterpolated) {
  replace_pose(2, flight_.stamp(2) + " nan 0 0 0 0 0 1");
  const auto sequence = Sequence::open(folder_.path());
  ASSERT_TRUE(sequence) << sequence.error().message;
  EXPECT_EQ(sequence->size(), flight_.size());
  EXPECT_THAT(sequence->skipped(),
              ElementsAre(skipped("groundtruth.txt", "line 3: the pose has a number that is not")));
  const Pose between = interpolate(flight_.T_world_camera[1], flight_.T_world_camera[3], 0.5);
  EXPECT_LT((sequence->pose(2).translation - between.translation).norm(), 1e-9);
  expect_strict_refuses("not finite");
}

TEST_F(DamagedSequence, PoseRowWithZeroQuaternionAtTheEndTakesItsFrameAlong) {
  replace_pose(5, flight_.stamp(5) + " 1 2 3 0 0 0 0");
  const auto sequence = Sequence::open(folder_.path());
  ASSERT_TRUE(sequence) << sequence.error().message;
  EXPECT_EQ(sequence->size(), flight_.size() - 1);
  EXPECT_THAT(sequence->skipped(), ElementsAre(skipped("groundtruth.txt", "line 6: the quaternion is zero"),
                                               skipped(rgb_name(5), "lies outside the poses")));
}

TEST_F(DamagedSequence, NothingButZeroQuaternionsIsRefused) {
  test::write_text(folder_ / "groundtruth.txt", "1 0 0 0 0 0 0 0\n2 0 0 0 0 0 0 0\n");
  expect_refused({"groundtruth.txt: no usable pose in 2 rows", "line 1: the quaternion is zero"});
}

TEST_F(DamagedSequence, NothingButNanIsRefused) {
  test::write_text(folder_ / "groundtruth.txt", "1 nan nan nan 0 0 0 1\n");
  expect_refused({"groundtruth.txt: no usable pose in 1 rows", "not finite"});
}

TEST_F(DamagedSequence, MissingPoseFileIsRefused) {
  std::filesystem::remove(folder_ / "groundtruth.txt");
  expect_refused({"groundtruth.txt: no such file", "--poses from-imu-gnss", "--log"});
}

TEST_F(DamagedSequence, UnsortedPosesAreSortedAndDuplicatesSkipped) {
  std::string text;
  for (std::size_t i = flight_.size(); i-- > 0;)
    text += test::pose_row(flight_.stamp(i), flight_.T_world_camera[i]);
  text += test::pose_row(flight_.stamp(1), Pose{});
  test::write_text(folder_ / "groundtruth.txt", text);
  const auto sequence = Sequence::open(folder_.path());
  ASSERT_TRUE(sequence) << sequence.error().message;
  EXPECT_THAT(sequence->skipped(), ElementsAre(skipped("groundtruth.txt", "line 7: time")));
  EXPECT_THAT(sequence->notes(), ElementsAre(HasSubstr("have been sorted")));
  for (std::size_t i = 0; i < flight_.size(); ++i) {
    EXPECT_EQ(sequence->pose(i).translation, flight_.T_world_camera[i].translation);
  }
}

TEST_F(DamagedSequence, FramesBeyondThePosesAreSkipped) {
  std::string text;
  for (std::size_t i = 1; i < 4; ++i) text += test::pose_row(flight_.stamp(i), flight_.T_world_camera[i]);
  test::write_text(folder_ / "groundtruth.txt", text);
  const auto sequence = Sequence::open(folder_.path());
  ASSERT_TRUE(sequence) << sequence.error().message;
  EXPECT_EQ(sequence->size(), 3U);
  EXPECT_THAT(sequence->skipped(),
              ElementsAre(skipped(rgb_name(0), "no pose: "), skipped(rgb_name(4), "no pose: "),
                          skipped(rgb_name(5), "lies outside the poses, which cover 1403636579.1")));
}

TEST_F(DamagedSequence, PosesThatCoverFewFramesAreRefused) {
  std::string text;
  for (std::size_t i = 1; i < 3; ++i) text += test::pose_row(flight_.stamp(i), flight_.T_world_camera[i]);
  test::write_text(folder_ / "groundtruth.txt", text);
  expect_refused({"4 of 6 frames unusable", "no pose"});
}

TEST_F(DamagedSequence, PosesOfAnotherDayAreRefused) {
  std::string text;
  for (int i = 0; i < 6; ++i) text += test::pose_row(fmt::format("{}", i), Pose{});
  test::write_text(folder_ / "groundtruth.txt", text);
  expect_refused({"0 of 6 frames usable", "lies outside the poses, which cover 0.000000 to 5.000000"});
}

TEST_F(DamagedSequence, CalibrationOfAnotherCameraIsRefusedByTheSizes) {
  Camera other = flight_.camera;
  other.width = 640;
  test::write_text(folder_ / "camera.yaml", test::camera_yaml(other));
  expect_refused({"the image has 64 x 48 pixels, expected 640 x 48"});
}

TEST_F(DamagedSequence, MissingCalibrationIsRefused) {
  std::filesystem::remove(folder_ / "camera.yaml");
  expect_refused({"camera.yaml: no such file"});
  SequenceOptions options;
  options.calibration = (folder_ / "nowhere.yaml").string();
  EXPECT_THAT(Sequence::open(folder_.path(), options).error().message,
              HasSubstr("nowhere.yaml: no such file"));
}

struct YamlChange {
  const char* name;
  const char* from;
  const char* to;
  const char* message;
};

class DamagedCalibration : public DamagedSequence, public testing::WithParamInterface<YamlChange> {};

TEST_P(DamagedCalibration, IsRefused) {
  std::string yaml = test::camera_yaml(flight_.camera);
  const std::string from = GetParam().from;
  yaml.replace(yaml.find(from), from.size(), GetParam().to);
  test::write_text(folder_ / "camera.yaml", yaml);
  expect_refused({(folder_ / "camera.yaml").string(), GetParam().message});
}

INSTANTIATE_TEST_SUITE_P(Kinds, DamagedCalibration,
                         testing::Values(YamlChange{"WithoutFocalLength", "fx: 60\n", "",
                                                    "field fx is missing"},
                                         YamlChange{"WithNegativeFocalLength", "fx: 60\n", "fx: -60\n",
                                                    "line 3: field fx: found \"-60\""},
                                         YamlChange{"WithUnknownModel", "plumb_bob", "double_sphere",
                                                    "found distortion model \"double_sphere\""},
                                         YamlChange{"WithNegativeDepthScale", "depth_scale: 1000",
                                                    "depth_scale: -1", "field depth_scale"}),
                         [](const auto& kind) { return std::string(kind.param.name); });

TEST_F(DamagedSequence, DepthImageCutShortIsAnErrorOfThatFrameAlone) {
  for (std::size_t i = 0; i < 2; ++i) {
    test::write_image(folder_.path() / "depth" / (flight_.stamp(i) + ".png"),
                      cv::Mat::ones(48, 64, CV_16UC1));
  }
  const auto file = folder_.path() / "depth" / (flight_.stamp(1) + ".png");
  const std::string bytes = test::read_bytes(file);
  test::write_text(file, bytes.substr(0, bytes.size() - 5));
  const auto sequence = Sequence::open(folder_.path());
  ASSERT_TRUE(sequence) << sequence.error().message;
  EXPECT_TRUE(sequence->truth(0));
  EXPECT_FALSE(sequence->truth(1));
  EXPECT_FALSE(sequence->truth(2)) << "there is none";
}

TEST_F(DamagedSequence, OptionsWithoutMeaningAreRefused) {
  for (const auto& change : {+[](SequenceOptions& o) { o.largest_pose_gap = -1; },
                             +[](SequenceOptions& o) { o.largest_truth_gap = std::nan(""); },
                             +[](SequenceOptions& o) { o.mask_growth = -1; }}) {
    SequenceOptions options;
    change(options);
    EXPECT_FALSE(Sequence::open(folder_.path(), options));
  }
}

/// Six frames with true depth of their own, `off` seconds late, in files that end in `ending`.
void write_with_depth(const fs::path& folder, double off, const std::string& ending) {
  const Flight flight = test::make_flight();
  test::write_tum(folder, flight);
  for (const Time time : flight.times) {
    const Time late{time.nanoseconds + Time::from_seconds(off).nanoseconds};
    const fs::path file = folder / "depth" / (to_string(late) + ".png");
    test::write_image(file, cv::Mat(48, 64, CV_16UC1, cv::Scalar(2000)));
    if (ending != ".png") fs::rename(file, fs::path(file).replace_extension(ending));
  }
}

TEST(DamagedTruth, ThatNoFrameGetsIsSkippedWithItsReason) {
  struct Case {
    double off;
    const char* ending;
    const char* reason;  // nullptr: used
  };
  for (const Case& one :
       {Case{0, ".png", nullptr},
        {0.015, ".png", nullptr},
        {0.03, ".png", "found 6 depth images, none within 0.02 s of a frame (the nearest is 0.03 s"},
        {1e5, ".png", "none within 0.02 s of a frame"},
        {0, ".npy", "found 6 files in it and no depth image"},
        {0, ".exr", "found 6 files in it and no depth image"}}) {
    const test::TemporaryFolder folder;
    write_with_depth(folder.path(), one.off, one.ending);
    SequenceOptions options;
    const auto sequence = Sequence::open(folder.path(), options);
    ASSERT_TRUE(sequence) << sequence.error().message;
    EXPECT_EQ(sequence->size(), 6U);
    EXPECT_EQ(sequence->has_truth(), one.reason == nullptr) << one.off << one.ending;
    options.strict = true;
    const auto strict = Sequence::open(folder.path(), options);
    EXPECT_EQ(strict.ok(), one.reason == nullptr);
    if (one.reason == nullptr) {
      EXPECT_THAT(sequence->skipped(), IsEmpty());
      EXPECT_FALSE(sequence->depth_file(3).empty());
      continue;
    }
    ASSERT_EQ(sequence->skipped().size(), 1U) << one.off << one.ending;
    EXPECT_EQ(sequence->skipped()[0].file, "depth");
    EXPECT_THAT(sequence->skipped()[0].reason, HasSubstr(one.reason));
    EXPECT_THAT(strict.error().message, HasSubstr(one.reason));
  }
}

}  // namespace
}  // namespace pade::io
