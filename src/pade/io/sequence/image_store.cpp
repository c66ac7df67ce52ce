#include "pade/io/sequence/image_store.hpp"

#include "pade/io/text.hpp"

namespace pade::io {

Result<ImageInfo> ImageStore::inspect(const std::filesystem::path& image) const {
  return inspect_image(image);
}

Result<cv::Mat> ImageStore::read(const std::filesystem::path& image) const { return read_image(image); }

Result<EncodedImage> ImageStore::encoded(const std::filesystem::path& image) const {
  auto bytes = read_file(image);
  if (!bytes) return bytes.error();
  return EncodedImage{image.extension().string(), std::move(*bytes)};
}

}  // namespace pade::io
