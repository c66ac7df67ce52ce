// Any bytes are either refused or give a flow field whose known vectors survive being written and read again.
#include <cmath>
#include <cstdint>
#include <cstring>
#include <span>

#include "pade/io/flow_file.hpp"

#include "expect.hpp"

namespace {

// Bit patterns, so that NaN equals NaN; unknown vectors are NaN in both components.
bool same(const cv::Mat& a, const cv::Mat& b) {
  if (a.size() != b.size() || a.type() != CV_32FC2 || b.type() != CV_32FC2) return false;
  for (int y = 0; y < a.rows; ++y) {
    for (int x = 0; x < a.cols; ++x) {
      const auto& p = a.at<cv::Vec2f>(y, x);
      const auto& q = b.at<cv::Vec2f>(y, x);
      const bool unknown = std::isnan(p[0]) && std::isnan(p[1]) && std::isnan(q[0]) && std::isnan(q[1]);
      if (!unknown && !(p[0] == q[0] && p[1] == q[1])) return false;
    }
  }
  return true;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const std::span<const std::uint8_t> bytes(data + 1, size - 1);
  if (data[0] % 2 == 0) {
    const auto read = pade::io::decode_flo(bytes, "input");
    if (!read) return 0;
    const auto again = pade::io::decode_flo(pade::io::encode_flo(*read), "again");
    PADE_EXPECT(again && same(*read, *again));
  } else {
    const auto read = pade::io::decode_kitti_flow(bytes, "input");
    if (!read || read->total() > 1000000) return 0;
    const auto again = pade::io::decode_kitti_flow(pade::io::encode_kitti_flow(*read), "again");
    PADE_EXPECT(again && same(*read, *again));
  }
  return 0;
}
