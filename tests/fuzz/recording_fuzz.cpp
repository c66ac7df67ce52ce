// Any bytes are either refused or a recording whose messages can be read or are refused themselves. One
// target for each format: PADE_READER is its reader, set by the build.
#include <cstdint>

#include <fmt/format.h>
#include <sys/mman.h>
#include <unistd.h>

#include "pade/io/recording/flight/recorded_images.hpp"
#include "pade/io/recording/messages/messages.hpp"
#include "pade/io/recording/recording.hpp"

#include "expect.hpp"

namespace {

using namespace pade::io;  // NOLINT

void decode(const Topic& topic, const std::string& bytes, MessageEncoding encoding) {
  if (const auto image = read_image_message(bytes, encoding)) {
    if (const auto pixels = pixels_of(*image)) PADE_EXPECT(!pixels->empty());
  }
  (void)read_compressed_image(bytes, encoding);
  (void)read_camera_info(bytes, encoding);
  (void)read_imu_message(bytes, encoding);
  (void)read_nav_sat_fix(bytes, encoding);
  (void)read_magnetic_field(bytes, encoding);
  (void)read_pressure(bytes, encoding);
  (void)read_twist(topic.type, bytes, encoding);
  (void)read_pose_message(topic.type, bytes, encoding);
  (void)read_transforms(bytes, encoding);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const int file = memfd_create("recording", 0);
  PADE_EXPECT(file >= 0 && write(file, data, size) == static_cast<ssize_t>(size));
  const auto content = PADE_READER(fmt::format("/proc/self/fd/{}", file));
  if (content) {
    for (const Topic& topic : content->topics) {
      for (const MessagePlace& place : topic.messages) {
        PADE_EXPECT(place.time.nanoseconds >= 0 && place.time.nanoseconds <= kLastTime);
        const auto bytes = content->source->read(place, 1U << 20);
        if (!bytes) continue;
        decode(topic, *bytes, MessageEncoding::ros1);
        decode(topic, *bytes, MessageEncoding::cdr);
      }
    }
  }
  close(file);
  return 0;
}
