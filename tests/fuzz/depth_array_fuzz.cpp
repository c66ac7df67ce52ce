// Any bytes are either refused by name or an array of the size that they state.
#include <cstdint>
#include <string_view>

#include "pade/io/sequence/depth_file.hpp"

#include "expect.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto depth = pade::io::parse_npy_depth({reinterpret_cast<const char*>(data), size}, "input");
  if (!depth) {
    PADE_EXPECT(depth.error().message.starts_with("input: "));
    return 0;
  }
  PADE_EXPECT(depth->type() == CV_32FC1 && depth->rows > 0 && depth->cols > 0);
  PADE_EXPECT(depth->total() * 2 < size);
  return 0;
}
