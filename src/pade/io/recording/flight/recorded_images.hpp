// Camera images of a recording: sensor_msgs/Image and CompressedImage.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "pade/io/recording/messages/messages.hpp"
#include "pade/io/recording/recording.hpp"
#include "pade/io/sequence/image_store.hpp"
#include "pade/io/skipped.hpp"

namespace pade::io {

/// An image of a recording, as a layout lists it: the recording's name with topic and time behind it.
struct RecordedImage {
  Time time;
  std::filesystem::path name;
};
/// The images of a topic, and who reads them by their names.
struct RecordedImages {
  std::vector<RecordedImage> images;
  std::shared_ptr<const ImageStore> store;
  std::string frame;  ///< of the camera, as the first image has it
};

/// Errors: no message of the topic can be read.
Result<RecordedImages> recorded_images(std::shared_ptr<const Recording> recording, const Topic& topic,
                                       ReadReport& report);

/// Whether the pixels are those of a camera, and not depths or labels: by the first message.
bool is_camera_topic(const Recording& recording, const Topic& topic);

/// When the messages of a topic were made: by their headers. Where most headers say nothing, when they were
/// recorded; where a few do, those are empty and to be left out: both with a note. Errors: the topic is
/// written in a way that is not understood.
Result<std::vector<std::optional<Time>>> stamps_of(const Recording& recording, const Topic& topic,
                                                   ReadReport& report);

}  // namespace pade::io
