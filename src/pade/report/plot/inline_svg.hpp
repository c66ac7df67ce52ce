// Makes the SVG that gnuplot writes fit to stand in an HTML page beside others.
#pragma once

#include <string>
#include <string_view>

namespace pade::evaluation {

/// The <svg> element of gnuplot's output without what comes before it, its own titles and its version, with
/// `title` for screen readers, and every id and every reference to one beginning with `id`.
/// @param id  as it may stand in an attribute: a letter, then letters, digits, '-' and '_'.
std::string inline_svg(std::string_view gnuplot_svg, std::string_view id, std::string_view title);

/// `wanted` with what an id may not hold replaced by '-'; a digest of `content` if it is empty.
std::string id_of(std::string_view wanted, std::string_view content);

}  // namespace pade::evaluation
