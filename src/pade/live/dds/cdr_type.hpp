// A type for CycloneDDS whose samples are messages that are CDR already: no compiler of IDL, no second copy
// of what a message is.
#pragma once

#include <string>
#include <string_view>

#include <dds/dds.h>
#include <dds/ddsi/ddsi_serdata.h>
#include <dds/ddsi/ddsi_sertype.h>

namespace pade::live::cdr_type {

/// What dds_write() takes: a message with the four bytes before it that tell the order of bytes.
struct Sample {
  std::string_view bytes;
};

/// A new type; dds_create_topic_sertype() takes it over.
/// @param name  as on the wire: "sensor_msgs::msg::dds_::Image_"
ddsi_sertype* create(const std::string& name);

/// The bytes of a sample that dds_takecdr() gave; they live as long as it does.
std::string_view bytes_of(const ddsi_serdata* sample);

}  // namespace pade::live::cdr_type
