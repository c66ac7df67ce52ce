// Any bytes as an image file: head and tail, then the decoder, which must agree with the head.
#include <cstdint>
#include <filesystem>
#include <fstream>

#include <unistd.h>

#include "pade/io/sequence/image_file.hpp"

#include "expect.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const std::filesystem::path file =
      std::filesystem::temp_directory_path() / ("pade-image-fuzz-" + std::to_string(::getpid()));
  std::ofstream(file, std::ios::binary)
      .write(reinterpret_cast<const char*>(data), static_cast<std::streamsize>(size));
  const auto info = pade::io::inspect_image(file);
  if (!info || info->size.area() > 1 << 20) return 0;  // a header may ask for gigabytes; decode small ones
  const auto image = pade::io::read_image(file);
  if (image) PADE_EXPECT(image->size() == info->size && image->channels() == info->channels);
  return 0;
}
