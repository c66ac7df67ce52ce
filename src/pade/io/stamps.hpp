// Stamps as text in whatever unit a file counts them: seconds, milliseconds, microseconds or nanoseconds.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

#include "pade/core/time.hpp"

namespace pade::io {

/// How a column of stamps counts.
enum class TimeUnit { seconds, milliseconds, microseconds, nanoseconds };

/// "seconds", ...
std::string_view name_of(TimeUnit unit);

/// The unit that stamps count in, from their steps: cameras, receivers and IMUs deliver something between a
/// thousand times per second and every few seconds. Empty if the steps fit no unit, or there are none.
/// @param slowest  longest usual step, s
std::optional<TimeUnit> guess_unit(std::span<const std::string_view> stamps, double slowest);

/// A stamp of a unit; whole numbers keep every digit. Empty if the text is no number of that unit within
/// what Time holds.
std::optional<Time> parse_stamp(std::string_view text, TimeUnit unit);

/// The same for the stamps of images and poses, which may also be minutes apart: seconds, unless they are a
/// thousand and more apart (median) and fit microseconds or nanoseconds, or are as large as milliseconds
/// since 1970.
TimeUnit unit_of_frames(std::span<const std::string_view> stamps);

/// The median distance between neighbouring stamps, in what they count; NaN if there are none.
double median_step(std::span<const std::string_view> stamps);
/// How many of these are a second.
std::int64_t nanoseconds_per(TimeUnit unit);

}  // namespace pade::io
