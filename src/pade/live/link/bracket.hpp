// Between which of a source's samples a time lies.
#pragma once

#include <algorithm>
#include <cstddef>
#include <string_view>

#include "pade/core/sensors/pose_jumps.hpp"
#include "pade/core/time.hpp"
#include "pade/live/link/pose_source.hpp"

namespace pade::live {

/// Where a time lies among samples.
struct Bracket {
  PoseAnswer::Kind kind = PoseAnswer::Kind::not_yet;
  std::size_t after = 0;  ///< index of the sample at or behind the time
  double share = 0;       ///< of the way to it from the one before
  std::string_view why;
};

/// @param samples  each with its `time`, in their order
template <class Samples>
Bracket bracket(const Samples& samples, Time time) {
  using Kind = PoseAnswer::Kind;
  if (samples.empty() || samples.back().time < time) return {};
  const auto after =
      std::find_if(samples.begin(), samples.end(), [&](const auto& sample) { return sample.time >= time; });
  const auto index = static_cast<std::size_t>(after - samples.begin());
  if (after->time == time) return {Kind::valid, index, 1, {}};
  if (index == 0) return {Kind::never, 0, 0, "the image is older than the poses"};
  const auto& before = samples[index - 1];
  const double gap = seconds_between(before.time, after->time);
  if (gap > kFarthestPosesApart) return {Kind::never, 0, 0, "a gap in the poses"};
  return {Kind::valid, index, seconds_between(before.time, time) / gap, {}};
}

}  // namespace pade::live
