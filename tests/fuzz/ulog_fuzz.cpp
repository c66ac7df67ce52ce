// Any bytes as a log of PX4: what is found is finite or missing, whatever the descriptions in the file claim.
#include <cmath>
#include <cstdint>
#include <string>

#include "pade/live/recordings/ulog.hpp"

#include "expect.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  // Files begin alike: half of the inputs need not find that out.
  std::string bytes(reinterpret_cast<const char*>(data), size);
  if (size > 0 && data[0] != 'U')
    bytes.insert(0, std::string("ULog\x01\x12\x35\x01", 8) + std::string(8, '\0'));
  const auto log = pade::live::Ulog::parse(bytes, "input");
  if (!log) {
    PADE_EXPECT(!log.error().message.empty());
    return 0;
  }
  for (const auto& topic : log->topics()) {
    if (!topic.rows.empty()) PADE_EXPECT(log->find(topic.name, topic.instance) != nullptr);
    for (const char* const field :
         {"timestamp", "gyro_rad[0]", "gyro_rad[2]", "lat", "latitude_deg", "a[65535]", "x"}) {
      const auto column = log->column(topic, field);
      if (column) PADE_EXPECT(column->size() == topic.rows.size());
    }
  }
  return 0;
}
