// Any bytes are either refused or give a flow field whose known vectors survive being written and read again.
#include <cstddef>
#include <cstdint>
#include <span>

#include "pade/io/formats/flow_file.hpp"

#include "expect.hpp"
#include "same_flow.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  constexpr std::size_t kLargest = 1000000;  // pixels: larger ones only take longer
  const auto read = pade::io::decode_kitti_flow(std::span(data, size), "input");
  if (!read || read->total() > kLargest) return 0;
  const auto again = pade::io::decode_kitti_flow(pade::io::encode_kitti_flow(*read), "again");
  PADE_EXPECT(again && pade::fuzz::same_flow(*read, *again));
  return 0;
}
