// Camera images of a recording: sensor_msgs/Image and CompressedImage.
#pragma once

#include <memory>
#include <string_view>

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

/// The pixels of a message: 8 or 16 bit, grey or BGR. Error for an encoding that is not understood, or fewer
/// bytes than its rows need.
Result<cv::Mat> pixels_of(const ImageMessage& image);

/// When the messages of a topic were made: by their headers, or where one of them says nothing, when they
/// were recorded, with a note. Errors: a message is too short for a header.
Result<std::vector<Time>> stamps_of(const Recording& recording, const Topic& topic, ReadReport& report);

}  // namespace pade::io
