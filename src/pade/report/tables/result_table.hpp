// A table of results in the forms that people and programs read: terminal, Markdown, CSV, JSON; in HTML it is
// part of the page (experiment_report.hpp).
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include <nlohmann/json_fwd.hpp>

namespace pade::evaluation {

/// For people: everything is text already.
struct ResultTable {
  std::string name;     ///< "table1"
  std::string title;    ///< one line
  std::string command;  ///< that makes this table alone
  std::string note;     ///< how to read it; may be empty
  std::vector<std::string> columns;
  std::vector<std::vector<std::string>> rows;
};

/// Columns of figures go to the right; a column of words has no cell that begins like a number.
bool is_words(const ResultTable& table, std::size_t column);

/// Title, column names, rows, note; the columns are padded by the width of their characters.
std::string to_text(const ResultTable& table);
/// Column names and rows.
std::string to_markdown(const ResultTable& table);

/// For programs: one figure per field, at full precision. NaN is an empty field, null in JSON.
struct DataTable {
  using Field = std::variant<std::string, double, std::uint64_t>;
  std::string name;
  std::vector<std::string> columns;
  std::vector<std::vector<Field>> rows;
};

std::string to_csv(const DataTable& table);
/// An array with one object per row.
nlohmann::ordered_json json_of(const DataTable& table);

}  // namespace pade::evaluation
