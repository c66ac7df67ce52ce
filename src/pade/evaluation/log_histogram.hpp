// Medians of millions of values in fixed memory: a histogram whose buckets are 1/2048 wide, relative to the
// value.
#pragma once

#include <cstdint>
#include <vector>

namespace pade::evaluation {

/// Counts positive values in buckets that split every power of two into 2048 parts. A quantile is right to
/// 1/2048 (0.05 %) of itself between 2^-24 and 2^16; smaller and larger values are held at those ends. Adding
/// is order-independent, so that the result is the same bits for any order of the pixels.
class LogHistogram {
 public:
  LogHistogram();

  /// Not NaN; values <= 0 count as the smallest.
  void add(float value);
  void add(const LogHistogram& other);

  [[nodiscard]] std::uint64_t count() const { return count_; }
  /// The value that a share of `quantile` in [0, 1] of all values stays below, linear within a bucket; NaN
  /// where there are none.
  [[nodiscard]] double quantile(double quantile) const;
  [[nodiscard]] double median() const { return quantile(0.5); }

 private:
  std::vector<std::uint64_t> buckets_;
  std::uint64_t count_ = 0;
};

}  // namespace pade::evaluation
