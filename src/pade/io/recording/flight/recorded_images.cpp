#include "pade/io/recording/flight/recorded_images.hpp"

#include <algorithm>
#include <optional>
#include <unordered_map>
#include <utility>

#include <fmt/format.h>

#include "pade/io/image/image_codec.hpp"
#include "pade/io/recording/messages/pixel_encoding.hpp"
#include "pade/io/text.hpp"

namespace pade::io {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kHeadBytes = 4096;  // enough for every field of an image before its pixels

bool is_compressed(const Topic& topic) { return topic.type == "sensor_msgs/CompressedImage"; }

/// Reads the images of one topic by the names that they were listed under.
class RecordedStore : public ImageStore {
 public:
  RecordedStore(std::shared_ptr<const Recording> recording, bool compressed, MessageEncoding encoding)
      : recording_(std::move(recording)), compressed_(compressed), encoding_(encoding) {}

  void add(const fs::path& name, const MessagePlace& place) { places_.emplace(name.string(), place); }

  [[nodiscard]] Result<ImageInfo> inspect(const fs::path& image) const override {
    const std::string name = image.string();
    if (compressed_) {
      const auto file = compressed(name);
      if (!file) return file.error();
      auto info = inspect_image_bytes(file->bytes, name);
      if (info && file->mosaic != nullptr) info->channels = 3;
      return info;
    }
    const MessagePlace& place = places_.at(name);
    const auto bytes = recording_->read(place, kHeadBytes);
    if (!bytes) return bytes.error();
    const auto head = read_image_head(*bytes, encoding_);
    if (!head) return named(name, head.error());
    const auto info = info_of(*head);
    if (!info) return named(name, info.error());
    const std::uint64_t pixels = std::uint64_t{head->step} * head->height;
    if (pixels > place.size) {
      return named(name, Error{fmt::format("the image has {} bytes, expected {} in {} rows", place.size,
                                           pixels, head->height)});
    }
    return *info;
  }

  [[nodiscard]] Result<cv::Mat> read(const fs::path& image) const override {
    const std::string name = image.string();
    if (compressed_) {
      const auto file = compressed(name);
      if (!file) return file.error();
      return pixels_of_file(file->bytes, file->mosaic, name);
    }
    const auto bytes = recording_->read(places_.at(name));
    if (!bytes) return bytes.error();
    const auto message = read_image_message(*bytes, encoding_);
    if (!message) return named(name, message.error());
    auto pixels = pixels_of(*message);
    if (!pixels) return named(name, pixels.error());
    return pixels;
  }

  [[nodiscard]] Result<EncodedImage> encoded(const fs::path& image) const override {
    if (compressed_) {
      auto file = compressed(image.string());
      if (!file) return file.error();
      if (file->mosaic == nullptr)
        return EncodedImage{file->bytes.starts_with("\x89PNG") ? ".png" : ".jpg", std::move(file->bytes)};
    }
    const auto pixels = read(image);
    if (!pixels) return pixels.error();
    const bool png = (pixels->depth() == CV_8U || pixels->depth() == CV_16U) && !pixels->empty();
    const auto bytes = png ? encode_png(*pixels) : std::vector<std::uint8_t>();
    if (bytes.empty()) return named(image.string(), Error{"cannot be written as PNG"});
    return EncodedImage{".png", std::string(bytes.begin(), bytes.end())};
  }

 private:
  static Error named(const std::string& name, const Error& error) {
    return Error{fmt::format("{}: {}", name, error.message)};
  }
  /// PNG or JPEG of a CompressedImage.
  struct Compressed {
    std::string bytes;
    const PixelEncoding* mosaic = nullptr;  ///< if a grey picture stands for colours
  };
  [[nodiscard]] Result<Compressed> compressed(const std::string& name) const {
    const auto bytes = recording_->read(places_.at(name));
    if (!bytes) return bytes.error();
    const auto message = read_compressed_image(*bytes, encoding_);
    if (!message) return named(name, message.error());
    Compressed file{std::string(message->data), nullptr};
    const auto mosaic = mosaic_in(message->format, message->data, name);
    if (!mosaic) return mosaic.error();
    file.mosaic = *mosaic;
    return file;
  }

  std::shared_ptr<const Recording> recording_;
  bool compressed_;
  MessageEncoding encoding_;
  std::unordered_map<std::string, MessagePlace> places_;
};

}  // namespace

bool is_camera_topic(const Recording& recording, const Topic& topic) {
  const auto encoding = message_encoding(topic.encoding);
  if (!encoding || topic.messages.empty()) return false;
  const auto bytes = recording.read(topic.messages.front(), kHeadBytes);
  if (!bytes) return false;
  if (is_compressed(topic)) {
    MessageReader reader(*bytes, *encoding);
    if (reader.ros1()) reader.number<std::uint32_t>();
    reader.stamp();
    reader.text();
    const std::string_view format = reader.text();
    return format.find("compressedDepth") == std::string_view::npos && !format.starts_with("16UC1") &&
           !format.starts_with("32FC1");
  }
  const auto head = read_image_head(*bytes, *encoding);
  return !head || (!head->encoding.starts_with("16UC1") && !head->encoding.starts_with("32"));
}

Result<std::vector<std::optional<Time>>> stamps_of(const Recording& recording, const Topic& topic,
                                                   ReadReport& report) {
  const auto encoding = message_encoding(topic.encoding);
  if (!encoding)
    return Error{fmt::format("{}: topic {} is written as {}, expected ros1 or cdr", recording.file().string(),
                             topic.name, in_quotes(topic.encoding))};
  std::vector<std::optional<Time>> stamps;
  std::size_t silent = 0;
  for (const MessagePlace& place : topic.messages) {
    const auto bytes = recording.read(place, kHeadBytes);
    if (!bytes) return bytes.error();
    const auto header = read_header(*bytes, *encoding);
    stamps.emplace_back();
    // 0 is a time where the recording begins at 0, as simulated flights do; or, in a bag, at the first time
    // that is one there.
    if (header && (header->stamp.nanoseconds != 0 || place.time.nanoseconds <= 1)) {
      stamps.back() = header->stamp;
    } else {
      ++silent;
    }
  }
  if (silent == 0) return stamps;
  if (2 * silent < stamps.size()) {
    report.notes.push_back(fmt::format("{}: {} of {} messages have no stamp in their header and are left out",
                                       topic.name, silent, stamps.size()));
    return stamps;
  }
  report.notes.push_back(
      fmt::format("{}: {} of {} messages have no stamp in their header: the times of recording are "
                  "taken",
                  topic.name, silent, stamps.size()));
  std::transform(topic.messages.begin(), topic.messages.end(), stamps.begin(),
                 [](const MessagePlace& place) { return std::optional(place.time); });
  return stamps;
}

Result<RecordedImages> recorded_images(std::shared_ptr<const Recording> recording, const Topic& topic,
                                       ReadReport& report) {
  const auto stamps = stamps_of(*recording, topic, report);
  if (!stamps) return stamps.error();
  const MessageEncoding encoding = *message_encoding(topic.encoding);
  RecordedImages found;
  const auto first = recording->read(topic.messages.front(), kHeadBytes);
  if (!first) return first.error();
  if (const auto header = read_header(*first, encoding)) found.frame = header->frame;
  const fs::path folder = fs::path(recording->file().string() + topic.name);
  auto store = std::make_shared<RecordedStore>(recording, is_compressed(topic), encoding);
  for (std::size_t i = 0; i < stamps->size(); ++i) {
    const auto time = (*stamps)[i];
    if (!time) continue;
    found.images.push_back({*time, folder / to_string(*time)});
    store->add(found.images.back().name, topic.messages[i]);
  }
  found.store = std::move(store);
  return found;
}

}  // namespace pade::io
