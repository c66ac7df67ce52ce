#include "pade/report/tables/result_table.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace pade::evaluation {
namespace {

using Json = nlohmann::ordered_json;

/// Characters of UTF-8 text.
std::size_t width(std::string_view text) {
  return static_cast<std::size_t>(std::count_if(
      text.begin(), text.end(), [](char c) { return (static_cast<unsigned char>(c) & 0xC0U) != 0x80U; }));
}

std::string padded(const std::string& text, std::size_t to, bool left) {
  const std::string blanks(to - std::min(to, width(text)), ' ');
  return left ? text + blanks : blanks + text;
}

std::string csv_field(const DataTable::Field& field) {
  if (const auto* text = std::get_if<std::string>(&field)) {
    if (text->find_first_of(",\"\n") == std::string::npos) return *text;
    std::string quoted;
    for (const char c : *text) quoted.append(c == '"' ? 2 : 1, c);
    return fmt::format("\"{}\"", quoted);
  }
  if (const auto* count = std::get_if<std::uint64_t>(&field)) return fmt::format("{}", *count);
  const double value = std::get<double>(field);
  return std::isfinite(value) ? fmt::format("{}", value) : "";
}

Json json_field(const DataTable::Field& field) {
  return std::visit(
      [](const auto& value) -> Json {
        if constexpr (std::is_same_v<std::decay_t<decltype(value)>, double>) {
          if (!std::isfinite(value)) return nullptr;
        }
        return value;
      },
      field);
}

}  // namespace

bool is_words(const ResultTable& table, std::size_t column) {
  return std::none_of(table.rows.begin(), table.rows.end(), [column](const auto& row) {
    if (column >= row.size()) return false;
    const std::string& cell = row[column];
    const std::size_t first = cell.find_first_not_of("+-");
    return first != std::string::npos && std::isdigit(static_cast<unsigned char>(cell[first])) != 0;
  });
}

std::string to_text(const ResultTable& table) {
  std::vector<std::size_t> widths;
  for (std::size_t c = 0; c < table.columns.size(); ++c) {
    std::size_t widest = width(table.columns[c]);
    for (const auto& row : table.rows) widest = std::max(widest, width(row[c]));
    widths.push_back(widest);
  }
  const auto line = [&](const std::vector<std::string>& row) {
    std::string text;
    for (std::size_t c = 0; c < row.size(); ++c)
      text.append(c > 0 ? "  " : "").append(padded(row[c], widths[c], is_words(table, c)));
    while (text.ends_with(' ')) text.pop_back();
    return text + "\n";
  };
  std::string text = table.title + "\n\n" + line(table.columns);
  for (const auto& row : table.rows) text += line(row);
  if (!table.note.empty()) text += "\n" + table.note + "\n";
  return text;
}

std::string to_markdown(const ResultTable& table) {
  const auto line = [](const std::vector<std::string>& row) {
    std::string text = "|";
    for (const std::string& field : row) text += fmt::format(" {} |", field);
    return text + "\n";
  };
  std::string text = line(table.columns) + "|";
  for (std::size_t c = 0; c < table.columns.size(); ++c) text += is_words(table, c) ? "---|" : "--:|";
  text += "\n";
  for (const auto& row : table.rows) text += line(row);
  return text;
}

std::string to_csv(const DataTable& table) {
  std::string csv = fmt::format("{}\n", fmt::join(table.columns, ","));
  for (const auto& row : table.rows) {
    for (std::size_t c = 0; c < row.size(); ++c) csv.append(c > 0 ? "," : "").append(csv_field(row[c]));
    csv += "\n";
  }
  return csv;
}

Json json_of(const DataTable& table) {
  Json rows = Json::array();
  for (const auto& row : table.rows) {
    Json object;
    for (std::size_t c = 0; c < row.size(); ++c) object[table.columns[c]] = json_field(row[c]);
    rows.push_back(std::move(object));
  }
  return rows;
}

}  // namespace pade::evaluation
