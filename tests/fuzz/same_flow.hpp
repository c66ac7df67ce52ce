// Equality of flow fields, for the targets that write what they read and read it again.
#pragma once

#include <cmath>

#include <opencv2/core.hpp>

namespace pade::fuzz {

/// Same size and same known vectors; unknown ones are NaN in both components of both.
inline bool same_flow(const cv::Mat& a, const cv::Mat& b) {
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

}  // namespace pade::fuzz
