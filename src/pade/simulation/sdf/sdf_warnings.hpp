// What an SDF file holds and libsdformat or the simulator do not take, so that nothing is left out in
// silence.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <sdf/Element.hh>

#include "pade/core/result.hpp"

namespace pade::simulation {

/// One sentence per kind of element that is in the file and has no effect, with the place of its first
/// appearance. Elements that concern dynamics, contacts and user interfaces are not worth a word: there is
/// nothing to show of them.
std::vector<std::string> unsupported_elements(const sdf::ElementPtr& root, const std::string& file);

/// "file:line" of an element, as far as they are known; `file` is that of the world.
std::string place_of(const sdf::ElementPtr& element, const std::string& file);

/// Refuses numbers that libsdformat would cut: of "0,4" it reads the 0. @return the first, with its place.
Status check_numbers(const sdf::ElementPtr& root, const std::string& file);

/// The first error among what libsdformat printed (it prints some errors without returning them).
std::optional<std::string> printed_error(const std::string& printed);

}  // namespace pade::simulation
