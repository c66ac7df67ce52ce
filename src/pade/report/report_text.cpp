#include "pade/report/report_text.hpp"

#include <cmath>

#include <fmt/format.h>

#include "pade/report/report_style.hpp"

namespace pade::evaluation {

std::string escape_html(std::string_view text) {
  std::string safe;
  for (const char c : text) {
    if (c == '&')
      safe += "&amp;";
    else if (c == '<')
      safe += "&lt;";
    else if (c == '>')
      safe += "&gt;";
    else if (c == '"')
      safe += "&quot;";
    else
      safe += c;
  }
  return safe;
}

std::string begin_page(std::string_view title, std::string_view style, std::span<const std::string> remarks) {
  const std::string safe = escape_html(title);
  std::string html = fmt::format(
      "<!doctype html><html lang=\"en\"><head><meta charset=\"utf-8\"><title>{}</title><style>{}{}"
      "</style></head><body><main>\n<h1>{}</h1>\n",
      safe, report_style, style, safe);
  for (const std::string& remark : remarks) html += fmt::format("<p>{}</p>\n", escape_html(remark));
  return html;
}

std::string percent_text(double share) {
  return std::isnan(share) ? "–" : fmt::format("{:.1f} %", 100 * share);
}

std::string number_text(double value, int decimals) {
  return std::isnan(value) ? "–" : fmt::format("{:.{}f}", value, decimals);
}

std::string grouped_text(std::uint64_t value) {
  std::string digits = std::to_string(value);
  for (auto at = static_cast<std::ptrdiff_t>(digits.size()) - 3; at > 0; at -= 3) {
    digits.insert(static_cast<std::size_t>(at), "\u202f");
  }
  return digits;
}

}  // namespace pade::evaluation
