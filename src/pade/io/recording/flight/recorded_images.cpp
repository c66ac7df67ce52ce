#include "pade/io/recording/flight/recorded_images.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <optional>
#include <unordered_map>
#include <utility>

#include <fmt/format.h>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "pade/io/text.hpp"

namespace pade::io {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kHeadBytes = 4096;  // enough for every field of an image before its pixels
constexpr int kAsItIs = -1;

/// An encoding of sensor_msgs/Image.
struct PixelEncoding {
  std::string_view name;
  int type;        ///< of the bytes, as OpenCV has them
  int conversion;  ///< to grey or BGR
};

const PixelEncoding* pixel_encoding(std::string_view name) {
  // OpenCV names a Bayer pattern by its second row.
  static constexpr std::array<PixelEncoding, 16> kKnown = {{
      {"mono8", CV_8UC1, kAsItIs},
      {"8UC1", CV_8UC1, kAsItIs},
      {"mono16", CV_16UC1, kAsItIs},
      {"bgr8", CV_8UC3, kAsItIs},
      {"8UC3", CV_8UC3, kAsItIs},
      {"rgb8", CV_8UC3, cv::COLOR_RGB2BGR},
      {"bgr16", CV_16UC3, kAsItIs},
      {"rgb16", CV_16UC3, cv::COLOR_RGB2BGR},
      {"bgra8", CV_8UC4, cv::COLOR_BGRA2BGR},
      {"rgba8", CV_8UC4, cv::COLOR_RGBA2BGR},
      {"bayer_rggb8", CV_8UC1, cv::COLOR_BayerBG2BGR},
      {"bayer_bggr8", CV_8UC1, cv::COLOR_BayerRG2BGR},
      {"bayer_gbrg8", CV_8UC1, cv::COLOR_BayerGR2BGR},
      {"bayer_grbg8", CV_8UC1, cv::COLOR_BayerGB2BGR},
      {"yuv422", CV_8UC2, cv::COLOR_YUV2BGR_UYVY},
      {"yuv422_yuy2", CV_8UC2, cv::COLOR_YUV2BGR_YUY2},
  }};
  const auto* const found = std::find_if(kKnown.begin(), kKnown.end(),
                                         [&](const PixelEncoding& known) { return known.name == name; });
  return found == kKnown.end() ? nullptr : found;
}

Result<ImageInfo> info_of(const ImageMessage& image) {
  const PixelEncoding* const encoding = pixel_encoding(image.encoding);
  if (encoding == nullptr) {
    return Error{
        fmt::format("found the encoding {}, expected mono8, mono16, rgb8, bgr8, rgba8, bgra8, rgb16, bgr16, "
                    "yuv422 or bayer_*8",
                    in_quotes(image.encoding))};
  }
  constexpr std::uint32_t kLongest = 1U << 20;
  if (image.width == 0 || image.height == 0 || image.width > kLongest || image.height > kLongest)
    return Error{fmt::format("the image states {} x {} pixels", image.width, image.height)};
  const bool grey = CV_MAT_CN(encoding->type) == 1 && encoding->conversion == kAsItIs;
  return ImageInfo{{static_cast<int>(image.width), static_cast<int>(image.height)},
                   CV_MAT_DEPTH(encoding->type) == CV_16U ? 16 : 8,
                   grey ? 1 : 3};
}

bool is_compressed(const Topic& topic) { return topic.type == "sensor_msgs/CompressedImage"; }

/// Of the pixels in a CompressedImage, as image_transport writes it: "bayer_rggb8; jpeg compressed " for what
/// was sent, or "bayer_rggb8; jpeg compressed bgr8", where it was converted before.
std::string_view encoding_inside(std::string_view format) {
  constexpr std::string_view kKey = "compressed ";
  const std::size_t semicolon = format.find(';');
  if (semicolon == std::string_view::npos) return {};
  if (const std::size_t at = format.find(kKey, semicolon); at != std::string_view::npos) {
    const std::string_view inside = format.substr(at + kKey.size());
    const std::string_view word = inside.substr(0, inside.find(' '));
    if (!word.empty()) return word;
  }
  return format.substr(0, semicolon);
}

/// Pixels as they were sent, in grey or BGR.
Result<cv::Mat> converted(const cv::Mat& sent, const PixelEncoding& encoding) {
  if (encoding.conversion == kAsItIs) return sent.clone();
  cv::Mat pixels;
  try {  // OpenCV throws on sizes that a pattern cannot have
    cv::cvtColor(sent, pixels, encoding.conversion);
  } catch (const std::exception&) {
    return Error{fmt::format("{} x {} pixels of {} cannot be decoded", sent.cols, sent.rows, encoding.name)};
  }
  return pixels;
}

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
      const auto stored = read_image_bytes(file->bytes, name);
      if (!stored || file->mosaic == nullptr) return stored;
      if (stored->depth() != CV_8U)
        return named(
            name, Error{fmt::format("found {} bits of a Bayer mosaic, expected 8", 8 * stored->elemSize1())});
      auto colours = converted(*stored, *file->mosaic);
      if (!colours) return named(name, colours.error());
      return colours;
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
    std::vector<unsigned char> bytes;
    if (!cv::imencode(".png", *pixels, bytes))
      return named(image.string(), Error{"cannot be written as PNG"});
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
    const std::string_view pixels = encoding_inside(message->format);
    if (!pixels.starts_with("bayer_")) return file;
    const auto info = inspect_image_bytes(file.bytes, name);
    if (!info) return info.error();
    if (info->channels != 1) return file;
    file.mosaic = pixel_encoding(pixels);
    if (file.mosaic == nullptr)
      return named(name, Error{fmt::format("found the encoding {}, expected bayer_*8", in_quotes(pixels))});
    return file;
  }

  std::shared_ptr<const Recording> recording_;
  bool compressed_;
  MessageEncoding encoding_;
  std::unordered_map<std::string, MessagePlace> places_;
};

}  // namespace

Result<cv::Mat> pixels_of(const ImageMessage& image) {
  const auto info = info_of(image);
  if (!info) return info.error();
  const PixelEncoding& encoding = *pixel_encoding(image.encoding);
  const std::size_t row = image.width * CV_ELEM_SIZE(encoding.type);
  if (image.step < row || image.data.size() / image.step < image.height) {
    return Error{fmt::format("the image has {} bytes in rows of {}, expected {} rows of {} at least",
                             image.data.size(), image.step, image.height, row)};
  }
  const cv::Mat view(info->size, encoding.type, const_cast<char*>(image.data.data()),
                     image.step);  // NOLINT: only read
  auto sent = converted(view, encoding);
  if (!sent) return sent.error();
  cv::Mat pixels = std::move(*sent);
  if (info->bits == 16 && image.big_endian != (std::endian::native == std::endian::big)) {
    for (int y = 0; y < pixels.rows; ++y) {
      auto* const values = pixels.ptr<std::uint16_t>(y);
      for (int i = 0; i < pixels.cols * pixels.channels(); ++i)
        values[i] = static_cast<std::uint16_t>(values[i] << 8 | values[i] >> 8);
    }
  }
  return pixels;
}

Result<cv::Mat> pixels_of(const CompressedImageMessage& image) {
  auto stored = read_image_bytes(image.data, fmt::format("an image of {} bytes", image.data.size()));
  const std::string_view inside = encoding_inside(image.format);
  if (!stored || stored->channels() != 1 || !inside.starts_with("bayer_")) return stored;
  const PixelEncoding* const mosaic = pixel_encoding(inside);
  if (mosaic == nullptr || stored->depth() != CV_8U)
    return Error{fmt::format("found {} bits of the encoding {}, expected 8 of bayer_*8",
                             8 * stored->elemSize1(), in_quotes(inside))};
  return converted(*stored, *mosaic);
}

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
    if (header && header->stamp.nanoseconds != 0) {
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
