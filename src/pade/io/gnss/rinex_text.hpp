// Fixed columns of RINEX.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "pade/core/result.hpp"
#include "pade/core/sensors/raw_gnss.hpp"

namespace pade::io::rinex {

constexpr std::int64_t kNanoseconds = 1'000'000'000;  ///< of a second

/// The lines of a file, without their ends. Read forward once.
class Lines {
 public:
  explicit Lines(std::string_view text) : rest_(text) {}
  /// The next line, and moves on. Empty at the end.
  std::optional<std::string_view> next();
  /// The next line, and stays.
  [[nodiscard]] std::optional<std::string_view> peek() const;
  /// Of the line that next() gave last, from 1.
  [[nodiscard]] std::size_t number() const { return number_; }

 private:
  std::string_view rest_;
  std::size_t number_ = 0;
};

/// Columns `from` to `from + width`, as far as the line goes, without blanks at both ends.
std::string_view columns(std::string_view line, std::size_t from, std::size_t width);

/// A number in columns; the exponent may be E or D. Empty if the columns are blank or no finite number.
std::optional<double> number_at(std::string_view line, std::size_t from, std::size_t width);
/// A whole number in columns, of at most 9 digits.
std::optional<int> integer_at(std::string_view line, std::size_t from, std::size_t width);

/// Whether a system's letter is one of RINEX's, ours or not.
bool is_system_letter(char letter);

/// A satellite in the first three columns ("G08", "G 8"). Empty if it is none of ours.
std::optional<gnss::SatelliteId> satellite_at(std::string_view line);

/// The label of a header line, columns 60 to 80.
std::string_view label_of(std::string_view line);

/// Version of a header's first line, or why it is not one of 3.00 to 3.05 with this type ('O' or 'N').
Result<double> check_first_line(std::string_view line, char type, const std::string& where);

/// "name: line 12".
std::string at_line(std::string_view name, std::size_t line);

/// A time of week as the moment of that kind that is nearest to another: the week's number, which files have
/// with and without its rollover, is not needed.
Time nearest_week(double of_week, Time near);

/// Why no orbit has these elements; empty if one may have them.
std::string defect_of(const gnss::KeplerEphemeris& e);

/// Remarks of one kind: the first is told with its place, the others are counted.
class Tally {
 public:
  void add(std::string first) {
    if (count_++ == 0) first_ = std::move(first);
  }
  /// Appends one sentence if there were any.
  void report(std::vector<std::string>& remarks) const;

 private:
  std::size_t count_ = 0;
  std::string first_;
};

}  // namespace pade::io::rinex
