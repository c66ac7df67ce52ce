// Any bytes are either refused or give a flow field whose known vectors survive being written and read again.
#include <cstddef>
#include <cstdint>
#include <span>

#include "pade/io/formats/flow_file.hpp"

#include "expect.hpp"
#include "same_flow.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto read = pade::io::decode_flo(std::span(data, size), "input");
  if (!read) return 0;
  const auto again = pade::io::decode_flo(pade::io::encode_flo(*read), "again");
  PADE_EXPECT(again && pade::fuzz::same_flow(*read, *again));
  return 0;
}
