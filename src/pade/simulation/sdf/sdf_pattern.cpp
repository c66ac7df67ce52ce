#include "pade/simulation/sdf/sdf_pattern.hpp"

#include <cmath>
#include <cstdlib>
#include <string>
#include <utility>

#include <fmt/format.h>

#include "pade/simulation/sdf/sdf_warnings.hpp"

namespace pade::simulation {

Status read_pattern(const sdf::ElementPtr& element, const std::filesystem::path& file, Material& material) {
  if (!element || !element->HasElement("pade:pattern")) return {};
  const sdf::ElementPtr pattern = element->GetElement("pade:pattern");
  // libsdformat knows no line of an element that is not its own.
  const std::string where =
      place_of(pattern->LineNumber() ? pattern : element, file.string()) + ": <pade:pattern>";
  const auto name = pattern->GetValue() ? pattern->Get<std::string>() : std::string();
  const auto kind = from_name<PatternKind>(name);
  if (!kind) {
    std::string names;
    for (const auto& entry : EnumNames<PatternKind>::names)
      names += (names.empty() ? "" : ", ") + std::string(entry.second);
    return Error{fmt::format("{}: found '{}', expected one of {}", where, name, names)};
  }
  material.pattern.kind = *kind;
  for (const auto& [key, field] :
       {std::pair{"scale", &material.pattern.scale}, std::pair{"contrast", &material.pattern.contrast}}) {
    if (!pattern->HasAttribute(key)) continue;
    const auto text = pattern->GetAttribute(key)->GetAsString();
    char* end = nullptr;
    *field = std::strtod(text.c_str(), &end);
    if (end == text.c_str() || *end != '\0' || !std::isfinite(*field) || *field < 0 ||
        (*field == 0 && field == &material.pattern.scale)) {
      return Error{fmt::format("{}: found {}=\"{}\", expected a positive number", where, key, text)};
    }
  }
  return {};
}

}  // namespace pade::simulation
