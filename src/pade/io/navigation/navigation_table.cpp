#include "pade/io/navigation/navigation_table.hpp"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <limits>

#include <fmt/format.h>

namespace pade::io {
namespace {

std::string_view trimmed(std::string_view text) {
  const auto blank = [](char c) { return c == ' ' || c == '\t' || c == '\r'; };
  while (!text.empty() && blank(text.front())) text.remove_prefix(1);
  while (!text.empty() && blank(text.back())) text.remove_suffix(1);
  return text;
}

/// Takes the text up to the next `separator` off the front of `rest`.
std::string_view take(std::string_view& rest, char separator) {
  const std::size_t end = rest.find(separator);
  const std::string_view head = rest.substr(0, end);
  rest = end == std::string_view::npos ? std::string_view() : rest.substr(end + 1);
  return head;
}

double number_or_nan(std::string_view text) {
  text = trimmed(text);
  if (!text.empty() && text.front() == '+') text.remove_prefix(1);
  double value = 0;
  const auto [stop, status] = std::from_chars(text.data(), text.data() + text.size(), value);
  const bool whole = status == std::errc{} && stop == text.data() + text.size();
  return whole ? value : std::numeric_limits<double>::quiet_NaN();
}

/// A heading without its remarks in parentheses, which may hold commas.
std::string without_parentheses(std::string_view text) {
  std::string result;
  int depth = 0;
  for (const char c : text) {
    if (c == '(') ++depth;
    if (depth == 0) result += c;
    if (c == ')' && depth > 0) --depth;
  }
  return result;
}

std::vector<std::string> split(std::string_view line) {
  std::vector<std::string> fields;
  while (true) {
    const bool last = line.find(',') == std::string_view::npos;
    fields.emplace_back(trimmed(take(line, ',')));
    if (last) return fields;
  }
}

std::size_t count_fields(std::string_view line) {
  return 1 + static_cast<std::size_t>(std::count(line.begin(), line.end(), ','));
}

/// A plain line that names columns: its first field is a word.
bool is_heading(std::string_view first) {
  return !first.empty() && std::isalpha(static_cast<unsigned char>(first.front())) != 0 && first != "nan";
}

}  // namespace

std::optional<std::size_t> NumericTable::column(std::string_view prefix) const {
  for (std::size_t i = 0; i < columns.size(); ++i) {
    if (columns[i].starts_with(prefix)) return i;
  }
  return std::nullopt;
}

Result<std::size_t> NumericTable::group(std::string_view prefix, std::size_t count) const {
  const auto first = column(prefix);
  if (!first) return Error{fmt::format("{}: no column '{}' in the heading", name, prefix)};
  if (*first + count > width()) {
    return Error{
        fmt::format("{}: {} columns expected from '{}' on, found {}", name, count, prefix, width() - *first)};
  }
  return *first;
}

Result<NumericTable> parse_table(std::string_view text, std::string_view name) {
  NumericTable table;
  table.name = name;
  std::size_t line_number = 0;
  while (!text.empty()) {
    const std::string_view line = trimmed(take(text, '\n'));
    ++line_number;
    if (line.empty()) continue;
    if (line.front() == '#') {
      const std::string_view content = trimmed(line.substr(1));
      table.comment.append(content).push_back(' ');
      const std::string heading = without_parentheses(content);
      if (table.rows() == 0 && count_fields(heading) >= 2 && heading.find('=') == std::string::npos) {
        table.columns = split(heading);
      }
      continue;
    }
    const std::string_view first = trimmed(line.substr(0, line.find(',')));
    if (table.rows() == 0 && table.bad_lines == 0 && is_heading(first)) {
      table.columns = split(without_parentheses(line));
      continue;
    }
    if (table.columns.empty()) {
      return Error{fmt::format("{}:{}: found '{}', expected a heading with the names of the columns", name,
                               line_number, line.substr(0, 40))};
    }
    if (count_fields(line) != table.width()) {
      if (table.bad_lines++ == 0) table.first_bad_line = line_number;
      continue;
    }
    std::string_view rest = line;
    for (std::size_t i = 0; i < table.width(); ++i) table.values.push_back(number_or_nan(take(rest, ',')));
    table.stamps.push_back(first);
    table.line_numbers.push_back(line_number);
  }
  if (table.columns.empty())
    return Error{fmt::format("{}: empty, expected a heading and rows of numbers", name)};
  if (table.rows() == 0 || table.bad_lines > table.rows()) {
    return Error{table.bad_lines > 0
                     ? fmt::format("{}:{}: {} of {} lines do not have {} fields", name, table.first_bad_line,
                                   table.bad_lines, table.rows() + table.bad_lines, table.width())
                     : fmt::format("{}: no rows below the heading", name)};
  }
  return table;
}

}  // namespace pade::io
