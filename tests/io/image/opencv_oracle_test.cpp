// Our readers and writers of images against OpenCV's imgcodecs: the same values, bit for bit. A program of
// its own, the only one that links imgcodecs.
#include <algorithm>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <opencv2/imgcodecs.hpp>

#include "pade/io/image/image_codec.hpp"

#include "io/image/picture_files.hpp"

namespace pade::io {
namespace {

using test::FileBytes;
using test::PictureFile;

struct Wanted {
  Pixels pixels;
  int flags;
};
const Wanted kWanted[] = {
    {Pixels::stored, cv::IMREAD_UNCHANGED},
    {Pixels::opaque, cv::IMREAD_ANYCOLOR | cv::IMREAD_ANYDEPTH | cv::IMREAD_IGNORE_ORIENTATION},
    {Pixels::grey, cv::IMREAD_GRAYSCALE},
    {Pixels::colour, cv::IMREAD_COLOR},
};

/// Empty also where OpenCV throws.
cv::Mat opencv_decodes(const FileBytes& bytes, int flags) {
  try {
    return cv::imdecode(bytes, flags);
  } catch (const cv::Exception&) {
    return {};
  }
}

bool identical(const cv::Mat& a, const cv::Mat& b) {
  return a.size() == b.size() && a.type() == b.type() && cv::norm(a, b, cv::NORM_INF) == 0;
}

std::vector<PictureFile> all_files(int width, int height) {
  std::vector<PictureFile> files = test::png_files(width, height);
  for (const auto& more : {test::jpeg_files(width, height), test::pnm_files(width, height)})
    files.insert(files.end(), more.begin(), more.end());
  return files;
}

TEST(ImageOracle, WholeFilesHaveTheValuesOfOpenCv) {
  for (const cv::Size size : {cv::Size(37, 21), cv::Size(1, 1), cv::Size(16, 40)}) {
    for (const PictureFile& file : all_files(size.width, size.height)) {
      for (const auto& [pixels, flags] : kWanted) {
        const auto ours = decode_image(file.bytes, pixels);
        ASSERT_TRUE(ours) << file.name << ": " << ours.error().message;
        const cv::Mat theirs = opencv_decodes(file.bytes, flags);
        EXPECT_TRUE(identical(*ours, theirs))
            << file.name << " with flags " << flags << ": " << ours->size() << ", type " << ours->type()
            << "; OpenCV: " << theirs.size() << ", " << theirs.type();
      }
    }
  }
}

/// What OpenCV cannot read is refused; what we read has its values. We refuse more: it makes parts of
/// pictures up. Only where a JPEG has all but its last marker is it the other way round: then ours is the
/// whole picture.
void expect_no_worse(const PictureFile& whole, const FileBytes& broken, const Wanted& wanted,
                     const std::string& what) {
  const auto ours = decode_image(broken, wanted.pixels);
  if (!ours) {
    EXPECT_FALSE(ours.error().message.empty());
    return;
  }
  const cv::Mat theirs = opencv_decodes(broken, wanted.flags);
  EXPECT_TRUE(identical(*ours, theirs) || identical(*ours, opencv_decodes(whole.bytes, wanted.flags)))
      << whole.name << " " << what << ", flags " << wanted.flags;
}

TEST(ImageOracle, FilesCutShortAreRefused) {
  testing::internal::CaptureStderr();  // OpenCV prints about them
  for (const PictureFile& file : all_files(19, 17)) {
    const std::size_t step = std::max<std::size_t>(1, file.bytes.size() / 40);
    std::size_t read = 0;
    for (std::size_t length = 0; length < file.bytes.size(); length += step) {
      const FileBytes cut(file.bytes.begin(), file.bytes.begin() + static_cast<std::ptrdiff_t>(length));
      expect_no_worse(file, cut, kWanted[length % 4],
                      fmt::format("cut to {} of {}", length, file.bytes.size()));
      read += decode_image(cut, Pixels::opaque) ? 1 : 0;
    }
    EXPECT_EQ(read, 0U) << file.name;
  }
  const std::string said = testing::internal::GetCapturedStderr();
}

TEST(ImageOracle, FilesWithWrongBytesAreNoWorse) {
  testing::internal::CaptureStderr();
  cv::RNG random(17);
  for (const PictureFile& file : all_files(19, 17)) {
    for (int trial = 0; trial < 30; ++trial) {
      FileBytes broken = file.bytes;
      for (int i = random.uniform(1, 4); i > 0; --i)
        broken[static_cast<std::size_t>(random.uniform(0, static_cast<int>(broken.size())))] ^=
            static_cast<std::uint8_t>(1 << random.uniform(0, 8));
      expect_no_worse(file, broken, kWanted[trial % 4], fmt::format("of trial {}", trial));
    }
  }
  const std::string said = testing::internal::GetCapturedStderr();
}

TEST(ImageOracle, WrittenFilesHaveTheBytesOfOpenCv) {
  struct Case {
    PngPacking packing;
    std::vector<int> parameters;
  };
  const std::vector<Case> packings = {
      {{}, {}},
      {{.level = 1, .runs_only = false, .left_filter = false}, {cv::IMWRITE_PNG_COMPRESSION, 1}},
      {{.level = 9, .runs_only = false, .left_filter = false}, {cv::IMWRITE_PNG_COMPRESSION, 9}},
      {{.level = 6, .runs_only = true, .left_filter = false},
       {cv::IMWRITE_PNG_COMPRESSION, 6, cv::IMWRITE_PNG_STRATEGY, cv::IMWRITE_PNG_STRATEGY_RLE}},
  };
  for (const int channels : {1, 3, 4}) {
    cv::Mat image = test::picture(53, 31, channels);
    for (const int depth : {CV_8U, CV_16U}) {
      if (depth == CV_16U) image.convertTo(image, CV_16U, 257.3);
      const cv::Mat part = image(cv::Rect(2, 3, 40, 20));  // rows that are not one behind the other
      for (const auto& [packing, parameters] : packings) {
        FileBytes theirs;
        ASSERT_TRUE(cv::imencode(".png", part, theirs, parameters));
        EXPECT_EQ(encode_png(part, packing), theirs) << channels << " channels, depth " << depth;
      }
    }
  }
  for (const int channels : {1, 3}) {
    for (const int quality : {5, 60, 88, 95, 100}) {
      const cv::Mat part = test::picture(53, 31, channels)(cv::Rect(2, 3, 40, 20));
      FileBytes theirs;
      ASSERT_TRUE(cv::imencode(".jpg", part, theirs, {cv::IMWRITE_JPEG_QUALITY, quality}));
      EXPECT_EQ(encode_jpeg(part, quality), theirs) << channels << " channels, quality " << quality;
    }
    for (const int depth : {CV_8U, CV_16U}) {
      cv::Mat image = test::picture(53, 31, channels);
      if (depth == CV_16U) image.convertTo(image, CV_16U, 257.3);
      EXPECT_TRUE(identical(opencv_decodes(encode_pnm(image), cv::IMREAD_UNCHANGED), image));
    }
  }
}

TEST(ImageOracle, OtherFormatsAreReadThroughTheModule) {
  const cv::Mat colour = test::picture(75, 64, 3), grey = test::picture(75, 64, 1);
  cv::Mat deep, real;
  grey.convertTo(deep, CV_16U, 257.3);
  colour.convertTo(real, CV_32F, 1 / 7.0);
  struct Case {
    const char* ending;
    cv::Mat image;
    const char* format;
  };
  for (const auto& [ending, image, format] : std::vector<Case>{{".bmp", colour, "BMP"},
                                                               {".tiff", colour, "TIFF"},
                                                               {".tif", deep, "TIFF"},
                                                               {".tiff", real, "TIFF"},
                                                               {".webp", colour, "WebP"},
                                                               {".jp2", deep, "JPEG 2000"},
                                                               {".ras", grey, "Sun raster"},
                                                               {".pfm", real, "PFM"},
                                                               {".pbm", grey, "PBM"},
                                                               {".pam", grey, "PAM"},
                                                               {".hdr", real, "Radiance HDR"}}) {
    FileBytes bytes;
    ASSERT_TRUE(cv::imencode(ending, image, bytes)) << ending;
    for (const auto& [pixels, flags] : kWanted) {
      const auto ours = decode_image(bytes, pixels);
      ASSERT_TRUE(ours) << ending << ": " << ours.error().message;
      EXPECT_TRUE(identical(*ours, opencv_decodes(bytes, flags))) << ending << " with flags " << flags;
    }
    testing::internal::CaptureStderr();
    bytes.resize(bytes.size() / 8);
    const auto cut = decode_image(bytes, Pixels::opaque);
    const std::string said = testing::internal::GetCapturedStderr();
    if (!cut) {
      EXPECT_THAT(cut.error().message,
                  testing::HasSubstr(fmt::format("the {} image cannot be decoded", format)));
    }
  }
}

}  // namespace
}  // namespace pade::io
