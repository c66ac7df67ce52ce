#include "pade/live/dds/dds_options.hpp"

#include <algorithm>
#include <charconv>
#include <cstdlib>

#include <fmt/format.h>

#include "pade/core/option_check.hpp"

namespace pade::live {
namespace {

constexpr int kHighestDomain = 232;  // above, the ports do not fit

std::string_view environment(const char* name) {
  const char* const value = std::getenv(name);
  return value == nullptr ? std::string_view() : std::string_view(value);
}

bool is_name_letter(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_';
}

/// As ROS 2 has names: words of letters, digits and _ between /, none of which begins with a digit.
bool is_ros_name(std::string_view name) {
  char before = '/';
  for (const char c : name) {
    const bool digit = c >= '0' && c <= '9';
    if ((c != '/' && !is_name_letter(c)) || (before == '/' && (c == '/' || digit))) return false;
    before = c;
  }
  return before != '/';
}

}  // namespace

Status check(const DdsOptions& options) {
  const OptionRange ranges[] = {
      {"dds.domain", static_cast<double>(options.domain), -1, kHighestDomain},
      {"dds.map_period", options.map_period, 0.1, 3600},
  };
  if (const Status status = check_ranges(ranges); !status) return status;
  for (const auto& [field, topic] :
       {std::pair{"poses", options.poses}, std::pair{"camera_info", options.camera_info}}) {
    if (!is_topic(topic))
      return Error{fmt::format("dds.{}: found \"{}\", expected a topic such as /odom", field, topic)};
  }
  if (!options.name_space.empty() && !is_ros_name(options.name_space))
    return Error{fmt::format("dds.namespace: found \"{}\", expected a name such as uav1, without / before it",
                             options.name_space)};
  return {};
}

bool is_topic(std::string_view name) { return name.starts_with('/') && is_ros_name(name.substr(1)); }

Result<int> domain_of(const DdsOptions& options) {
  if (options.domain >= 0) return options.domain;
  const std::string_view text = environment("ROS_DOMAIN_ID");
  if (text.empty()) return 0;
  int domain = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), domain);
  if (error == std::errc() && end == text.data() + text.size() && domain >= 0 && domain <= kHighestDomain)
    return domain;
  return Error{fmt::format("ROS_DOMAIN_ID: found \"{}\", expected 0 to {}", text, kHighestDomain)};
}

bool is_local(const DdsOptions& options) {
  return options.localhost || environment("ROS_LOCALHOST_ONLY") == "1";
}

std::string own_topic(const DdsOptions& options, std::string_view topic) {
  if (options.name_space.empty()) return std::string(topic);
  return fmt::format("/{}{}", options.name_space, topic);
}

}  // namespace pade::live
