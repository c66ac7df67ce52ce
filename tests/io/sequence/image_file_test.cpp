#include "pade/io/sequence/image_file.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "io/sequence/flight_folders.hpp"
#include "support/temporary_folder.hpp"

namespace pade::io {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;

cv::Mat noise(int type) {
  cv::Mat image(48, 64, type);
  cv::RNG(3).fill(image, cv::RNG::UNIFORM, 0, image.depth() == CV_16U ? 65536 : 256);
  return image;
}

struct Kind {
  const char* name;
  const char* extension;
  int type;
};

class ImageKinds : public testing::TestWithParam<Kind> {
 protected:
  test::TemporaryFolder folder_;
  const std::filesystem::path file_ = folder_ / (std::string("image") + GetParam().extension);
  const cv::Mat image_ = noise(GetParam().type);
  void SetUp() override { test::write_image(file_, image_); }
};

TEST_P(ImageKinds, TheHeaderSaysWhatTheDecoderGives) {
  const auto info = inspect_image(file_);
  const auto image = read_image(file_);
  ASSERT_TRUE(info) << info.error().message;
  ASSERT_TRUE(image) << image.error().message;
  EXPECT_EQ(image->type(), GetParam().type);
  EXPECT_EQ(info->size, image->size());
  EXPECT_EQ(info->bits, static_cast<int>(8 * image->elemSize1()));
  EXPECT_EQ(info->channels, image->channels());
  if (std::string(GetParam().extension) != ".jpg") {
    EXPECT_TRUE(test::same_pixels(*image, image_));
  }
}

TEST_P(ImageKinds, AFileCutShortAnywhereIsAnErrorWithoutNoise) {
  const std::string bytes = test::read_bytes(file_);
  testing::internal::CaptureStderr();
  for (std::size_t length = 0; length < bytes.size(); length += length < 64 ? 1 : bytes.size() / 25) {
    test::write_text(file_, bytes.substr(0, length));
    const auto info = inspect_image(file_);
    EXPECT_FALSE(info) << length << " of " << bytes.size();
    const auto image = read_image(file_);
    EXPECT_FALSE(image) << length << " of " << bytes.size();
    if (!image) {
      EXPECT_THAT(image.error().message, HasSubstr(file_.string()));
    }
  }
  EXPECT_THAT(testing::internal::GetCapturedStderr(), IsEmpty());
}

INSTANTIATE_TEST_SUITE_P(All, ImageKinds,
                         testing::Values(Kind{"GreyPng", ".png", CV_8UC1}, Kind{"ColourPng", ".png", CV_8UC3},
                                         Kind{"DeepPng", ".png", CV_16UC1},
                                         Kind{"DeepColourPng", ".png", CV_16UC3},
                                         Kind{"GreyJpeg", ".jpg", CV_8UC1},
                                         Kind{"ColourJpeg", ".jpg", CV_8UC3}, Kind{"Pgm", ".pgm", CV_8UC1},
                                         Kind{"DeepPgm", ".pgm", CV_16UC1}, Kind{"Ppm", ".ppm", CV_8UC3}),
                         [](const auto& kind) { return std::string(kind.param.name); });

TEST(ImageFile, OneFlippedBitInsideAPngIsNoticed) {
  const test::TemporaryFolder folder;
  const auto file = folder / "image.png";
  test::write_image(file, noise(CV_8UC1));
  std::string bytes = test::read_bytes(file);
  bytes[bytes.size() / 2] = static_cast<char>(bytes[bytes.size() / 2] ^ 4);
  test::write_text(file, bytes);
  testing::internal::CaptureStderr();
  EXPECT_TRUE(inspect_image(file)) << "head and tail are whole";
  const auto image = read_image(file);
  ASSERT_FALSE(image);
  EXPECT_THAT(image.error().message, HasSubstr("wrong checksum"));
  EXPECT_THAT(testing::internal::GetCapturedStderr(), IsEmpty());
}

TEST(ImageFile, TransparencyIsDroppedAndGreyStaysGrey) {
  const test::TemporaryFolder folder;
  cv::Mat colour = noise(CV_8UC3);
  cv::Mat with_alpha;
  cv::cvtColor(colour, with_alpha, cv::COLOR_BGR2BGRA);
  test::write_image(folder / "alpha.png", with_alpha);
  const auto image = read_image(folder / "alpha.png");
  ASSERT_TRUE(image);
  EXPECT_TRUE(test::same_pixels(*image, colour));
}

TEST(ImageFile, WhatIsNoImageIsNamed) {
  const test::TemporaryFolder folder;
  test::write_text(folder / "text.png", "this is no image");
  test::write_text(folder / "empty.png", "");
  EXPECT_THAT(read_image(folder / "text.png").error().message, HasSubstr("cannot be decoded"));
  EXPECT_THAT(inspect_image(folder / "empty.png").error().message,
              HasSubstr("empty.png: the file is empty (0 bytes)"));
  EXPECT_THAT(inspect_image(folder / "missing.png").error().message, HasSubstr("no such file"));
  EXPECT_THAT(read_image(folder.path()).error().message, HasSubstr("not a regular file"));
}

}  // namespace
}  // namespace pade::io
