// Delimited numeric text with a heading: the common ground of every navigation log that we read.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "pade/core/result.hpp"

namespace pade::io {

/// Rows of numbers under named columns. Fields that are not numbers (empty, "nan", a list of satellites) are
/// NaN; whoever uses a column decides what that means.
struct NumericTable {
  std::string name;                       ///< of the file, for messages
  std::string comment;                    ///< text of all lines that start with '#', joined by a space
  std::vector<std::string> columns;       ///< trimmed, as written; empty where no heading was found
  std::vector<double> values;             ///< row-major, rows() x width()
  std::vector<std::string_view> stamps;   ///< the first field of each row as text (views into the input)
  std::vector<std::size_t> line_numbers;  ///< of each row, from 1
  std::size_t bad_lines = 0;              ///< lines with another number of fields, left out
  std::size_t first_bad_line = 0;

  [[nodiscard]] std::size_t width() const { return columns.size(); }
  [[nodiscard]] std::size_t rows() const { return line_numbers.size(); }
  [[nodiscard]] double at(std::size_t row, std::size_t column) const {
    return values[row * width() + column];
  }
  /// The first column whose name starts with `prefix`.
  [[nodiscard]] std::optional<std::size_t> column(std::string_view prefix) const;
  /// The column after `prefix` that starts a group of `count` neighbours, or an error that names what lacks.
  [[nodiscard]] Result<std::size_t> group(std::string_view prefix, std::size_t count) const;
};

/// Parses comma-separated text. The heading is the last '#' line with at least two fields before the data, or
/// a plain first line whose first field is not a number. `text` must outlive the table. Errors: no heading,
/// no row, more than half of the lines with the wrong number of fields.
Result<NumericTable> parse_table(std::string_view text, std::string_view name);

}  // namespace pade::io
