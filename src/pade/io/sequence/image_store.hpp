// Where the images of a sequence lie: in files, or in a recording.
#pragma once

#include <filesystem>
#include <string>

#include <opencv2/core.hpp>

#include "pade/core/result.hpp"
#include "pade/io/sequence/image_file.hpp"

namespace pade::io {

/// An image as it is kept: the bytes of a file.
struct EncodedImage {
  std::string ending;  ///< ".png"
  std::string bytes;
};

/// Files, unless a recording says otherwise. Any thread.
class ImageStore {
 public:
  ImageStore() = default;
  ImageStore(const ImageStore&) = delete;
  ImageStore& operator=(const ImageStore&) = delete;
  virtual ~ImageStore() = default;

  /// As inspect_image.
  [[nodiscard]] virtual Result<ImageInfo> inspect(const std::filesystem::path& image) const;
  /// As read_image.
  [[nodiscard]] virtual Result<cv::Mat> read(const std::filesystem::path& image) const;
  /// The bytes of its file; where there is none, those of a PNG with the same pixels.
  [[nodiscard]] virtual Result<EncodedImage> encoded(const std::filesystem::path& image) const;
};

}  // namespace pade::io
