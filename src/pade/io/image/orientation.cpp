#include "pade/io/image/orientation.hpp"

namespace pade::io {

int exif_orientation(ImageBytes tags) {
  constexpr int kAsItLies = 1;
  constexpr std::size_t kEntry = 12;
  constexpr std::uint32_t kOrientation = 0x0112, kTiff = 42;
  if (tags.size() < 8 || tags[0] != tags[1] || (tags[0] != 'I' && tags[0] != 'M')) return kAsItLies;
  const bool little = tags[0] == 'I';
  // 0 behind the end, where no entry is.
  const auto number = [&](std::size_t at, std::size_t count) {
    std::uint32_t value = 0;
    if (at > tags.size() || count > tags.size() - at) return value;
    for (std::size_t i = 0; i < count; ++i) value = value << 8U | tags[at + (little ? count - 1 - i : i)];
    return value;
  };
  if (number(2, 2) != kTiff) return kAsItLies;
  const std::size_t list = number(4, 4);
  const std::size_t entries = number(list, 2);
  for (std::size_t i = 0; i < entries; ++i) {
    const std::size_t at = list + 2 + i * kEntry;
    if (at + kEntry > tags.size()) break;
    if (number(at, 2) == kOrientation) return static_cast<int>(number(at + 8, 2));
  }
  return kAsItLies;
}

cv::Mat upright(const cv::Mat& image, int orientation) {
  constexpr int kUpDown = 0, kLeftRight = 1, kBoth = -1;
  cv::Mat turned = image;
  if (orientation >= 5 && orientation <= 8) cv::transpose(image, turned);
  switch (orientation) {
    case 2:
    case 6:
      cv::flip(turned, turned, kLeftRight);
      break;
    case 3:
    case 7:
      cv::flip(turned, turned, kBoth);
      break;
    case 4:
    case 8:
      cv::flip(turned, turned, kUpDown);
      break;
    default:  // 1, 5, and what EXIF does not know
      break;
  }
  return turned;
}

}  // namespace pade::io
