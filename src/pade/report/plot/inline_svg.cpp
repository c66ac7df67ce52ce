#include "pade/report/plot/inline_svg.hpp"

#include <algorithm>
#include <array>
#include <cctype>

#include <fmt/format.h>

#include "pade/core/fingerprint.hpp"
#include "pade/report/report_text.hpp"

namespace pade::evaluation {
namespace {

// Without every `<name>...</name>`.
std::string without(std::string text, std::string_view name) {
  const std::string open = fmt::format("<{}>", name), close = fmt::format("</{}>", name);
  for (std::size_t at = 0; (at = text.find(open, at)) != std::string::npos;) {
    const std::size_t end = text.find(close, at);
    if (end == std::string::npos) break;
    text.erase(at, end + close.size() - at);
  }
  return text;
}

// A tag with `prefix` put before each id that it defines or names.
std::string with_ids(std::string_view tag, std::string_view prefix) {
  constexpr std::array<std::string_view, 6> beginnings = {" id='",    " id=\"", "href='#",
                                                          "href=\"#", "url(#",  "url('#"};
  std::string changed(tag);
  for (const std::string_view beginning : beginnings) {
    for (std::size_t at = 0; (at = changed.find(beginning, at)) != std::string::npos;) {
      at += beginning.size();
      changed.insert(at, prefix);
    }
  }
  return changed;
}

}  // namespace

std::string inline_svg(std::string_view gnuplot_svg, std::string_view id, std::string_view title) {
  const std::size_t begin = std::min(gnuplot_svg.find("<svg"), gnuplot_svg.size());
  const std::string svg = without(without(std::string(gnuplot_svg.substr(begin)), "title"), "desc");
  const std::string prefix = fmt::format("{}-", id);
  std::string out;
  for (std::size_t at = 0; at < svg.size();) {
    // Ids stand in tags only; a '<' or '>' of the text is escaped.
    const std::size_t tag = std::min(svg.find('<', at), svg.size());
    const std::size_t end = std::min(svg.find('>', tag), svg.size() - 1) + 1;
    out += svg.substr(at, tag - at);
    if (tag < svg.size()) out += with_ids(std::string_view(svg).substr(tag, end - tag), prefix);
    at = std::max(end, tag);
  }
  constexpr std::string_view opening = "<svg";
  if (out.starts_with(opening)) {
    out.insert(std::min(out.find('>'), out.size() - 1) + 1,
               fmt::format("\n<title>{}</title>", escape_html(title)));
    out.insert(opening.size(), R"( class="plot" role="img")");
  }
  return out;
}

std::string id_of(std::string_view wanted, std::string_view content) {
  if (wanted.empty()) {
    Fingerprint digest;
    digest.bytes(content.data(), content.size());
    return fmt::format("plot-{}", digest.hex());
  }
  std::string id(wanted);
  for (char& c : id) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte >= 0x80 || (std::isalnum(byte) == 0 && c != '-' && c != '_')) c = '-';
  }
  return std::isalpha(static_cast<unsigned char>(id.front())) != 0 ? id : "plot-" + id;
}

}  // namespace pade::evaluation
