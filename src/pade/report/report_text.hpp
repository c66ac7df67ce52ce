// Text and numbers as the pages of reports show them.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace pade::evaluation {

/// `text` as text of HTML or SVG, or as the value of an attribute in double quotes.
std::string escape_html(std::string_view text);

/// Of the pages that show simple_plot() alone.
inline constexpr std::string_view plot_page_style =
    "svg.plot { width: 100%; max-width: 860px; display: block; background: #fff; }";

/// A page up to its title and remarks; whoever writes the rest ends it with </main></body></html>.
/// @param title, remarks  plain text. @param style  CSS beside report_style
std::string begin_page(std::string_view title, std::string_view style,
                       std::span<const std::string> remarks = {});

/// A share as percent with one decimal; a dash for NaN.
std::string percent_text(double share);
/// With that many decimals; a dash for NaN.
std::string number_text(double value, int decimals);
/// 1234567 as "1 234 567", with thin spaces that do not break.
std::string grouped_text(std::uint64_t value);

}  // namespace pade::evaluation
