#include "pade/evaluation/log_histogram.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

namespace pade::evaluation {
namespace {

// The upper bits of an IEEE float (exponent and 11 bits of mantissa) grow with the value and split each power
// of two evenly: they are the bucket's number.
constexpr int kDroppedBits = 23 - 11;
constexpr float kSmallest = 0x1p-24F;
constexpr float kLargest = 0x1p16F;

constexpr std::uint32_t bucket_of(float value) { return std::bit_cast<std::uint32_t>(value) >> kDroppedBits; }
constexpr std::uint32_t kFirst = bucket_of(kSmallest);
constexpr std::uint32_t kBuckets = bucket_of(kLargest) - kFirst + 1;

double lower_edge(std::size_t bucket) {
  return std::bit_cast<float>((static_cast<std::uint32_t>(bucket) + kFirst) << kDroppedBits);
}

}  // namespace

LogHistogram::LogHistogram() : buckets_(kBuckets, 0) {}

void LogHistogram::add(float value) {
  ++buckets_[bucket_of(std::clamp(value, kSmallest, kLargest)) - kFirst];
  ++count_;
}

void LogHistogram::add(const LogHistogram& other) {
  for (std::size_t i = 0; i < buckets_.size(); ++i) buckets_[i] += other.buckets_[i];
  count_ += other.count_;
}

double LogHistogram::quantile(double quantile) const {
  if (count_ == 0) return std::numeric_limits<double>::quiet_NaN();
  const double rank = quantile * static_cast<double>(count_);
  double before = 0;
  for (std::size_t i = 0; i < buckets_.size(); ++i) {
    const auto here = static_cast<double>(buckets_[i]);
    if (here > 0 && before + here >= rank) {
      return std::lerp(lower_edge(i), lower_edge(i + 1), (rank - before) / here);
    }
    before += here;
  }
  return kLargest;
}

}  // namespace pade::evaluation
