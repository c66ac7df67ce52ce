#include "pade/core/option_check.hpp"

#include <array>
#include <cmath>
#include <cstdio>
#include <string>
#include <utility>

namespace pade {
namespace {

constexpr std::string_view kStart = "option ";

std::string text_of(double value) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%g", value);
  return text.data();
}

std::string expected(const OptionRange& range) {
  const bool bounded = range.most < finite;
  if (range.least == above_zero) return bounded ? "above 0, at most " + text_of(range.most) : "above 0";
  return bounded ? text_of(range.least) + " to " + text_of(range.most) : "at least " + text_of(range.least);
}

}  // namespace

Status check_ranges(std::span<const OptionRange> ranges) {
  for (const OptionRange& range : ranges) {
    if (range.value >= range.least && range.value <= range.most) continue;  // false for NaN
    return Error{std::string(kStart) + std::string(range.name) + " is " + text_of(range.value) +
                 ", expected " + expected(range) + (std::isinf(range.value) ? ", finite" : "")};
  }
  return {};
}

Status within(std::string_view group, Status status) {
  if (status) return status;
  std::string message = status.error().message;
  if (message.starts_with(kStart)) message.insert(kStart.size(), std::string(group) + ".");
  return Error{std::move(message)};
}

}  // namespace pade
