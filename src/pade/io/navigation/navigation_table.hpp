// Delimited numeric text with a heading: the common ground of every navigation log that we read.
#pragma once

#include <cstddef>
#include <deque>
#include <initializer_list>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "pade/core/result.hpp"
#include "pade/core/time.hpp"
#include "pade/io/stamps.hpp"

namespace pade::io {

/// A column as its heading names it: "w_RS_S_x [rad s^-1]" is w_rs_s_x in rad s^-1.
struct ColumnName {
  std::string name;  ///< lower case, without its unit
  std::string unit;  ///< lower case, without blanks; empty if the heading gives none
};

/// Rows of numbers under named columns. Fields that are not numbers (empty, "nan", a list of satellites) are
/// NaN; whoever uses a column decides what that means.
struct NumericTable {
  std::string name;                      ///< of the file, for messages
  std::string comment;                   ///< text of all lines that start with '#', joined by a space
  std::vector<ColumnName> columns;       ///< empty if no heading was found
  std::vector<double> values;            ///< row-major, rows() x width()
  std::vector<std::string_view> stamps;  ///< the field of each row in `stamp_column` as text (into the input)
  std::size_t stamp_column =
      0;  ///< a header's stamp that is not 0; else the first of a name of time; else the first
  std::vector<std::size_t> line_numbers;  ///< of each row, from 1
  std::size_t bad_lines = 0;              ///< lines with another number of fields, left out
  std::size_t first_bad_line = 0;
  std::shared_ptr<std::deque<std::string>> converted;  ///< stamps with decimal commas, or in two columns
  std::optional<std::size_t> recorded;  ///< beside a header's stamp: when the message was recorded
  std::string_view first_row;           ///< the first line of data, for messages

  [[nodiscard]] std::size_t width() const { return columns.size(); }
  [[nodiscard]] std::size_t rows() const { return line_numbers.size(); }
  [[nodiscard]] double at(std::size_t row, std::size_t column) const {
    return values[row * width() + column];
  }
  /// The column of exactly this name (lower case), or of one of these names, in their order.
  [[nodiscard]] std::optional<std::size_t> column(std::string_view wanted) const;
  [[nodiscard]] std::optional<std::size_t> column(std::initializer_list<std::string_view> wanted) const;
  /// The names of the columns as a list, for messages.
  [[nodiscard]] std::string column_names() const;
  /// "line 3: found time "noon", expected seconds": why no row could be used, by the first of them.
  [[nodiscard]] std::string first_defect(const std::vector<std::optional<Time>>& times) const;
};

/// Parses text whose fields are separated by commas, semicolons, tabs or blanks, whichever the heading uses
/// (with semicolons and tabs a decimal comma is understood). The heading is the last '#' line with at least
/// two fields before the data, or a plain first line whose first field is not a number; a second line of
/// units is taken for those of the columns. Fields may be quoted. The paths of ROS topics before a name go
/// ("/imu/data/angular_velocity/x" is angular_velocity.x). `text` must outlive the table. Errors: no heading,
/// no row, more than half of the lines with the wrong number of fields.
Result<NumericTable> parse_table(std::string_view text, std::string_view name);

/// What a dialect knows of its stamps beyond what the heading says.
struct StampRule {
  std::optional<TimeUnit> unit = {};       ///< if the dialect fixes one
  std::optional<std::size_t> column = {};  ///< another column than stamp_column
  double slowest = 2;                      ///< longest usual step, s
};

/// The times of all rows (empty if a stamp cannot be read), in the unit that the heading states, else that of
/// the dialect if the steps can be such, else in the one that the steps fit. Appends a remark if it had to be
/// guessed and is not seconds, or contradicts the dialect, and if header and recording state two times.
/// Errors: a stated unit that the steps contradict.
Result<std::vector<std::optional<Time>>> times_of(const NumericTable& table, const StampRule& rule,
                                                  std::vector<std::string>& remarks);

}  // namespace pade::io
