// The procedural surface patterns and their names; pattern.cpp draws them.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>
#include <utility>

#include "pade/core/options.hpp"

namespace pade::simulation {

enum class PatternKind { none, plaster, brick, bark, grass, concrete, gravel, asphalt, leaves };

/// A procedural texture in metres on the surface.
struct Pattern {
  PatternKind kind = PatternKind::none;
  double scale = 1;     ///< 2 = everything twice as large
  double contrast = 1;  ///< 0 = the mean colour everywhere
  bool operator==(const Pattern&) const = default;
};

}  // namespace pade::simulation

template <>
struct pade::EnumNames<pade::simulation::PatternKind> {
  using K = pade::simulation::PatternKind;
  static constexpr std::array names = {
      std::pair{K::none, std::string_view("none")},     std::pair{K::plaster, std::string_view("plaster")},
      std::pair{K::brick, std::string_view("brick")},   std::pair{K::bark, std::string_view("bark")},
      std::pair{K::grass, std::string_view("grass")},   std::pair{K::concrete, std::string_view("concrete")},
      std::pair{K::gravel, std::string_view("gravel")}, std::pair{K::asphalt, std::string_view("asphalt")},
      std::pair{K::leaves, std::string_view("leaves")}};
};
