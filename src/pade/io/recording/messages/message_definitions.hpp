// Definitions of the messages that we write, as recordings carry them beside the messages.
#pragma once

#include <string>
#include <string_view>

#include "pade/io/recording/messages/messages.hpp"

namespace pade::io {

/// The definition of a message and of all that it is made of; empty for a type that we do not write.
/// @param type  "sensor_msgs/Image"
std::string message_definition(std::string_view type, MessageEncoding encoding);
/// What ROS 1 compares definitions by; empty as above.
std::string_view message_md5(std::string_view type);

}  // namespace pade::io
