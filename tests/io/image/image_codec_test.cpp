#include "pade/io/image/image_codec.hpp"

#include <fstream>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pade/io/crc32.hpp"
#include "pade/io/image/orientation.hpp"

#include "io/image/picture_files.hpp"
#include "support/temporary_folder.hpp"

namespace pade::io {
namespace {

using test::FileBytes;
using testing::AllOf;
using testing::HasSubstr;

bool is_mapped(const std::string& library) {
  std::ifstream maps("/proc/self/maps");
  return std::string(std::istreambuf_iterator<char>(maps), {}).find(library) != std::string::npos;
}

/// 2 x 2 pixels of 24 bits, the lower row first.
FileBytes small_bmp() {
  FileBytes bytes = {'B', 'M', 70, 0, 0, 0, 0, 0, 0, 0, 54, 0, 0, 0,  40,
                     0,   0,   0,  2, 0, 0, 0, 2, 0, 0, 0,  1, 0, 24, 0};
  bytes.resize(54);
  for (const int value : {1, 2, 3, 4, 5, 6, 0, 0, 7, 8, 9, 10, 11, 12, 0, 0})
    bytes.push_back(static_cast<std::uint8_t>(value));
  return bytes;
}

TEST(ImageModule, IsLoadedWhenSuchAFileComesAndNotBefore) {
  const cv::Mat image = test::picture(9, 7, 3);
  for (const auto& bytes : {encode_png(image), encode_jpeg(image), encode_pnm(image)})
    ASSERT_TRUE(decode_image(bytes, Pixels::stored));
  ASSERT_FALSE(decode_image(image_bytes("some words, no image"), Pixels::stored));
  EXPECT_FALSE(is_mapped("opencv_imgcodecs"));
  EXPECT_FALSE(is_mapped("libgdal"));
  const auto bmp = decode_image(small_bmp(), Pixels::stored);
#ifdef PADE_HAS_IMAGE_FORMATS
  ASSERT_TRUE(bmp) << bmp.error().message;
  EXPECT_EQ(bmp->at<cv::Vec3b>(0, 0), cv::Vec3b(7, 8, 9));
  EXPECT_EQ(bmp->at<cv::Vec3b>(1, 1), cv::Vec3b(4, 5, 6));
  EXPECT_TRUE(is_mapped("opencv_imgcodecs"));
#else
  ASSERT_FALSE(bmp);
  EXPECT_THAT(bmp.error().message, AllOf(HasSubstr("BMP"), HasSubstr("pade-image-formats")));
#endif
}

TEST(ImageCodec, FilesKeepTheirPixels) {
  const test::TemporaryFolder folder;
  for (const int channels : {1, 3, 4}) {
    cv::Mat image = test::picture(23, 15, channels);
    for (const int depth : {CV_8U, CV_16U}) {
      if (depth == CV_16U) image.convertTo(image, CV_16U, 257.3);
      for (const std::string name : {"a.png", "b.PNG", "c.pgm", "d.ppm"}) {
        if (channels == 4 && name > "c") continue;
        ASSERT_TRUE(save_image(folder / name, image));
        const auto again = load_image(folder / name, Pixels::stored);
        ASSERT_TRUE(again) << again.error().message;
        EXPECT_EQ(again->type(), image.type()) << name;
        EXPECT_EQ(cv::norm(*again, image, cv::NORM_INF), 0) << name;
      }
    }
  }
  EXPECT_THAT(load_image(folder / "missing.png", Pixels::grey).error().message, HasSubstr("missing.png"));
}

TEST(ImageCodec, NamesThatCannotBeWrittenAreRefused) {
  EXPECT_TRUE(check_image_name("picture.png"));
  EXPECT_TRUE(check_image_name("picture.JPG"));
  for (const char* name : {"picture", "picture.", "picture.docx"}) {
    ASSERT_FALSE(check_image_name(name)) << name;
    EXPECT_THAT(check_image_name(name).error().message, HasSubstr("expected .png"));
  }
}

TEST(ImageCodec, SizesBeyondTheLimitsAreRefusedBeforeMemoryIsTaken) {
  FileBytes png = encode_png(cv::Mat(1, 1, CV_8UC1, cv::Scalar(0)));
  png[17] = png[21] = 0x0F;  // 0x0F0001 pixels each way, with the checksum of such a header
  const std::uint32_t sum = crc32(&png[12], 17);
  for (unsigned i = 0; i < 4; ++i) png[29 + i] = static_cast<std::uint8_t>(sum >> (24 - 8 * i));
  EXPECT_THAT(decode_image(png, Pixels::stored).error().message,
              HasSubstr("the PNG header states 983041 x 983041"));
  for (const std::string head : {"P5\n60000 60000\n255\n", "P6\n2000000 1\n255\n", "P5\n0 5\n255\n"}) {
    const auto image = decode_image(image_bytes(head), Pixels::stored);
    ASSERT_FALSE(image);
    EXPECT_THAT(image.error().message, HasSubstr("the PNM header states"));
  }
}

TEST(ImageCodec, PartsThatAJpegLacksAreNotMadeUp) {
  for (const auto& file : test::jpeg_files(64, 48)) {
    for (const double share : {0.5, 0.7, 0.9}) {
      FileBytes cut(
          file.bytes.begin(),
          file.bytes.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(file.bytes.size())));
      EXPECT_FALSE(decode_image(cut, Pixels::colour)) << file.name << " " << share;
      cut.insert(cut.end(), {0xFF, 0xD9});  // a marker behind what is there: half a picture with an end
      if (file.name.starts_with("progressive") || file.name == "arithmetic.jpg") continue;
      EXPECT_FALSE(decode_image(cut, Pixels::colour)) << file.name << " " << share;
    }
  }
}

/// What a library would say of it on the terminal: a camera whose every frame is such would fill the pipe of
/// a log that nobody reads, and stop there.
TEST(ImageCodec, HarmlessFaultsAreNotSaid) {
  FileBytes jpeg = encode_jpeg(test::picture(32, 24, 3));
  jpeg.insert(jpeg.end() - 2, 40, 0);  // before the marker of the end
  FileBytes png = encode_png(test::picture(32, 24, 3));
  FileBytes chunk = {0, 0, 0, 1, 'b', 'K', 'G', 'D', 7};  // a background of one byte, where six are expected
  const std::uint32_t sum = crc32(&chunk[4], 5);
  for (const unsigned shift : {24U, 16U, 8U, 0U}) chunk.push_back(static_cast<std::uint8_t>(sum >> shift));
  constexpr std::ptrdiff_t kHead = 33;  // signature and IHDR
  png.insert(png.begin() + kHead, chunk.begin(), chunk.end());
  for (const FileBytes& bytes : {jpeg, png}) {
    testing::internal::CaptureStderr();
    const auto image = decode_image(bytes, Pixels::colour);
    EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
    EXPECT_TRUE(image) << image.error().message;
  }
}

TEST(ImageCodec, TagsThatLieAreNoOrientation) {
  const FileBytes good = test::orientation_tags(6, true);
  EXPECT_EQ(exif_orientation(good), 6);
  for (std::size_t length = 0; length < 22; ++length)
    EXPECT_EQ(exif_orientation(ImageBytes(good).first(length)), 1);
  FileBytes far = good;
  far[4] = far[5] = far[6] = far[7] = 0xFF;  // where the list begins
  EXPECT_EQ(exif_orientation(far), 1);
}

}  // namespace
}  // namespace pade::io
