// One mechanism for the options of every stage: a plain struct with defaults that names its fields once. The
// same list reads YAML, fills run.json and documents the defaults.
//
//   struct DepthOptions {
//     int window = 1;
//     template <class Self, class Visitor>
//     static void visit(Self& self, Visitor&& field) {
//       field("window", self.window, "n of the n x n averaging window, pixels");
//     }
//   };
//
// `Self` is DepthOptions or const DepthOptions. Field types: bool, int, double, std::string, enumerations
// with a pade::EnumNames specialisation, and nested option structs.
#pragma once

#include <array>
#include <concepts>
#include <optional>
#include <string_view>
#include <type_traits>
#include <utility>

namespace pade {

/// The names of an enumeration in files and on the command line. Specialise with
/// `static constexpr std::array names = {std::pair{Enum::value, std::string_view("name")}, ...};`
template <class Enum>
struct EnumNames;

/// An enumeration that has EnumNames.
template <class Enum>
concept NamedEnum = std::is_enum_v<Enum> && requires {
  EnumNames<Enum>::names;
};

/// The name of `value`; "?" if it is none of the enumeration's.
template <NamedEnum Enum>
constexpr std::string_view to_name(Enum value) {
  for (const auto& [candidate, name] : EnumNames<Enum>::names) {
    if (candidate == value) return name;
  }
  return "?";
}

/// The value of this exact name; empty if there is none.
template <NamedEnum Enum>
constexpr std::optional<Enum> from_name(std::string_view text) {
  for (const auto& [value, name] : EnumNames<Enum>::names) {
    if (name == text) return value;
  }
  return std::nullopt;
}

namespace detail {
struct AnyField {
  void operator()(std::string_view, auto&, std::string_view) const {}
};
}  // namespace detail

/// A struct whose `visit` names its fields.
template <class Options>
concept OptionStruct = requires(Options& options) {
  Options::visit(options, detail::AnyField{});
};

}  // namespace pade
