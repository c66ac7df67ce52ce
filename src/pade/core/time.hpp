// Time stamps: int64 nanoseconds, so that stamps compare exactly and survive a round trip through a file.
#pragma once

#include <compare>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace pade {

/// A moment, counted from the zero of the recording (often, but not always, the Unix epoch).
struct Time {
  std::int64_t nanoseconds = 0;  ///< since that zero; may be negative

  /// The nearest nanosecond. `seconds` is finite and less than 9.2e9 in magnitude.
  static Time from_seconds(double seconds);
  /// As a double, which at the size of Unix times keeps a quarter of a microsecond.
  [[nodiscard]] double seconds() const { return static_cast<double>(nanoseconds) * 1e-9; }
  /// Earlier is less.
  auto operator<=>(const Time&) const =
      default;  // NOLINT(modernize-use-nullptr): clang-tidy 14 sees one in it
};

/// `a - b` in seconds, exact to a nanosecond however large both are.
inline double seconds_between(Time b, Time a) {
  return static_cast<double>(a.nanoseconds - b.nanoseconds) * 1e-9;
}

/// Decimal seconds with six digits, or nine if the stamp is finer than a microsecond: "1305031102.175304".
std::string to_string(Time time);

/// Parses decimal seconds ("1305031102.175304", "12", "-0.5", "1e3") without passing through a double if
/// the text has no exponent. Empty if the text is not wholly a number of at most 4.6e9 seconds (the
/// year 2115) in magnitude, so that the difference of any two times fits.
std::optional<Time> parse_time(std::string_view text);

}  // namespace pade
