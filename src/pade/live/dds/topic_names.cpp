#include <fmt/format.h>

#include "pade/live/dds/network.hpp"

namespace pade::live {

std::string dds_type_name(std::string_view type) {
  const std::size_t slash = type.find('/');
  return fmt::format("{}::msg::dds_::{}_", type.substr(0, slash), type.substr(slash + 1));
}

std::string ros_type_name(std::string_view dds_name) {
  constexpr std::string_view kInside = "::msg::dds_::";
  const std::size_t at = dds_name.find(kInside);
  if (at == std::string_view::npos || !dds_name.ends_with('_')) return std::string(dds_name);
  std::string_view name = dds_name.substr(at + kInside.size());
  name.remove_suffix(1);
  return fmt::format("{}/{}", dds_name.substr(0, at), name);
}

}  // namespace pade::live
