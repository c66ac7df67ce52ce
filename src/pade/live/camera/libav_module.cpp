// The module for videos: FFmpeg's libraries, and with them some eighty more, which the program loads when a
// video is asked for. Nothing else links them.
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstring>
#include <exception>
#include <optional>
#include <string_view>

#include "pade/live/camera/video_module.hpp"

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
#include <libavutil/display.h>
#include <libavutil/imgutils.h>
#include <libswscale/swscale.h>
}

namespace pade::live {
namespace {

Time now_here() {
  const auto since = std::chrono::steady_clock::now().time_since_epoch();
  return {std::chrono::duration_cast<std::chrono::nanoseconds>(since).count()};
}

std::string text_of(int failure) {
  std::array<char, AV_ERROR_MAX_STRING_SIZE> text{};
  ::av_strerror(failure, text.data(), text.size());
  return text.data();
}

/// Whether the format's frames have stamps of their own. Of others FFmpeg makes them up, at 25 Hz.
bool has_stamps(const AVInputFormat& format) {
  const std::string_view name = format.name;
  return (format.flags & AVFMT_NOTIMESTAMPS) == 0 && !name.starts_with("image2") && !name.ends_with("_pipe");
}

/// How a picture has to be turned to be shown: first rows and columns exchanged, then mirrored.
struct Turn {
  bool transposed = false, left_right = false, upside_down = false;
};

/// By a display matrix, as ffmpeg and players read it, to within a degree. Empty: by no multiple of 90
/// degrees.
std::optional<Turn> turn_of(const std::int32_t* matrix) {
  const double angle = ::av_display_rotation_get(matrix);
  if (std::isnan(angle)) return Turn{};  // none, to ffmpeg too
  const double quarters = std::round(angle / 90);
  if (std::abs(angle - 90 * quarters) >= 1) return std::nullopt;
  // x' = a x + c y, y' = b x + d y
  const std::int32_t a = matrix[0], b = matrix[1], c = matrix[3], d = matrix[4];
  if (std::fmod(quarters, 2) == 0) return Turn{false, a < 0, d < 0};
  return Turn{true, c < 0, b < 0};
}

cv::Mat turned(cv::Mat image, const Turn& turn) {
  constexpr int kBoth = -1, kUpsideDown = 0, kLeftRight = 1;
  if (turn.transposed) {
    cv::Mat other;
    cv::transpose(image, other);
    image = other;
  }
  if (turn.left_right || turn.upside_down) {
    cv::Mat other;
    cv::flip(image, other, !turn.left_right ? kUpsideDown : turn.upside_down ? kBoth : kLeftRight);
    image = other;
  }
  return image;
}

class LibavVideo : public Video {
 public:
  explicit LibavVideo(const VideoPlace& place) : place_(place) {}
  ~LibavVideo() override {
    ::sws_freeContext(scaler_);
    ::av_frame_free(&frame_);
    ::av_packet_free(&packet_);
    ::avcodec_free_context(&decoder_);
    ::avformat_close_input(&input_);
  }

  bool open() {
    ::av_log_set_level(AV_LOG_QUIET);
    input_ = ::avformat_alloc_context();
    packet_ = ::av_packet_alloc();
    frame_ = ::av_frame_alloc();
    if (input_ == nullptr || packet_ == nullptr || frame_ == nullptr) return fail("no memory");
    input_->interrupt_callback = {&LibavVideo::is_over, this};
    wait_from_now(kOpening);
    AVDictionary* options = nullptr;
    if (place_.stream) {
      // Packets that UDP loses would damage every frame up to the next whole one.
      ::av_dict_set(&options, "rtsp_flags", "prefer_tcp", 0);
      ::av_dict_set(&options, "analyzeduration", "500000", 0);
    }
    // A file may be called anything; what looks like a protocol is none.
    const std::string address = place_.stream ? place_.name : "file:" + place_.name;
    const int opened = ::avformat_open_input(&input_, address.c_str(), nullptr, &options);
    ::av_dict_free(&options);
    if (opened < 0) return fail(reason(opened));
    stamped_ = has_stamps(*input_->iformat);
    if (!stamped_ && !place_.stream)
      return fail(
          "its format (" + std::string(input_->iformat->name) +
          ") has no stamps, and FFmpeg would make them up; `ffmpeg -framerate RATE -i IN -c copy OUT.mkv` "
          "writes it with those of a rate");
    if (const int found = ::avformat_find_stream_info(input_, nullptr); found < 0) return fail(reason(found));
    const AVCodec* codec = nullptr;
    stream_ = ::av_find_best_stream(input_, AVMEDIA_TYPE_VIDEO, -1, -1, &codec, 0);
    if (stream_ < 0 || codec == nullptr) return fail("found no pictures in it that can be decoded");
    decoder_ = ::avcodec_alloc_context3(codec);
    if (decoder_ == nullptr) return fail("no memory");
    const AVStream& stream = *input_->streams[stream_];
    std::size_t size = 0;
    const std::uint8_t* const matrix = ::av_stream_get_side_data(&stream, AV_PKT_DATA_DISPLAYMATRIX, &size);
    if (matrix != nullptr && !read_turn(matrix, size, turn_of_all_)) return false;
    if (::avcodec_parameters_to_context(decoder_, stream.codecpar) < 0) return fail("no memory");
    decoder_->thread_count = 1;  // frames would wait for one another, and the mapper has the other cores
    if (place_.stream) decoder_->flags |= AV_CODEC_FLAG_LOW_DELAY;
    if (const int ready = ::avcodec_open2(decoder_, codec, nullptr); ready < 0) return fail(text_of(ready));
    tick_ = ::av_q2d(stream.time_base);
    return true;
  }

  Read next(VideoFrame& frame) override {
    wait_from_now(place_.patience);
    while (true) {
      const int got = ::avcodec_receive_frame(decoder_, frame_);
      if (got == 0) return taken(frame);
      if (got == AVERROR_EOF) return Read::ended;
      if (got != AVERROR(EAGAIN)) return Read::unusable;
      const int read = ::av_read_frame(input_, packet_);
      if (read == AVERROR_EOF && !place_.stream) {
        ::avcodec_send_packet(decoder_, nullptr);  // the frames that it still holds
        continue;
      }
      if (read < 0) {
        fail(read == AVERROR_EOF ? "the sender has ended it" : reason(read));
        return Read::failed;
      }
      const bool ours = packet_->stream_index == stream_;
      if (ours) {
        wait_from_now(place_.patience);
        decoder_->reordered_opaque = now_here().nanoseconds;
      }
      const int sent = ours ? ::avcodec_send_packet(decoder_, packet_) : 0;
      ::av_packet_unref(packet_);
      if (sent < 0 && sent != AVERROR(EAGAIN)) return Read::unusable;
    }
  }
  [[nodiscard]] std::string why() const override { return why_; }

 private:
  static constexpr double kOpening = 5;  // s

  static int is_over(void* self) {
    const auto& video = *static_cast<const LibavVideo*>(self);
    if (video.place_.stop != nullptr && video.place_.stop(video.place_.asker)) return 1;
    return video.place_.stream && now_here() > video.deadline_ ? 1 : 0;
  }
  void wait_from_now(double seconds) {
    deadline_ = {now_here().nanoseconds + static_cast<std::int64_t>(1e9 * seconds)};
  }
  bool fail(std::string why) {
    why_ = std::move(why);
    return false;
  }
  [[nodiscard]] static std::string reason(int failure) {
    return failure == AVERROR_EXIT ? "nothing came in time" : text_of(failure);
  }

  /// False: it is of no use here, and why() says it.
  bool read_turn(const std::uint8_t* bytes, std::size_t size, Turn& turn) {
    std::array<std::int32_t, 9> matrix{};
    if (size < sizeof(matrix)) return true;
    std::memcpy(matrix.data(), bytes, sizeof(matrix));
    const auto known = turn_of(matrix.data());
    if (!known)
      return fail("its pictures are to be shown turned by " +
                  std::to_string(std::lround(-::av_display_rotation_get(matrix.data()))) +
                  " degrees, expected a multiple of 90");
    turn = *known;
    return true;
  }

  Read taken(VideoFrame& out) {
    try {
      return take(out);
    } catch (const std::exception&) {  // no memory
      ::av_frame_unref(frame_);
      return Read::unusable;
    }
  }
  Read take(VideoFrame& out) {
    const bool damaged = (frame_->flags & AV_FRAME_FLAG_CORRUPT) != 0 || frame_->decode_error_flags != 0;
    const std::int64_t stamp = frame_->best_effort_timestamp;
    out.arrived = {frame_->reordered_opaque};
    out.seconds = stamped_ ? static_cast<double>(stamp) * tick_ : out.arrived.seconds();
    Turn turn = turn_of_all_;
    const AVFrameSideData* const own = ::av_frame_get_side_data(frame_, AV_FRAME_DATA_DISPLAYMATRIX);
    const bool known = own == nullptr || read_turn(own->data, own->size, turn);
    const bool good = known && !damaged && (!stamped_ || stamp != AV_NOPTS_VALUE) && convert(out.image);
    if (good) out.image = turned(out.image, turn);
    ::av_frame_unref(frame_);
    if (!known) return Read::failed;
    return good ? Read::frame : Read::unusable;
  }

  bool convert(cv::Mat& image) {
    const auto format = static_cast<AVPixelFormat>(frame_->format);
    const bool grey = format == AV_PIX_FMT_GRAY8 || format == AV_PIX_FMT_GRAY10 ||
                      format == AV_PIX_FMT_GRAY12 || format == AV_PIX_FMT_GRAY16;
    const int width = frame_->width;
    const int height = frame_->height;
    constexpr int kLargest = 16384;
    if (width <= 0 || height <= 0 || width > kLargest || height > kLargest) return false;
    scaler_ = ::sws_getCachedContext(scaler_, width, height, format, width, height,
                                     grey ? AV_PIX_FMT_GRAY8 : AV_PIX_FMT_BGR24, SWS_BILINEAR, nullptr,
                                     nullptr, nullptr);
    if (scaler_ == nullptr) return false;
    // swscale writes a row in groups of pixels, and leaves the last one out where the row has no room for it.
    constexpr int kGroup = 32;
    const int wide = (width + kGroup - 1) / kGroup * kGroup;
    cv::Mat whole(height, wide, grey ? CV_8UC1 : CV_8UC3);
    std::array<std::uint8_t*, 4> rows{whole.data, nullptr, nullptr, nullptr};
    const std::array<int, 4> steps{static_cast<int>(whole.step), 0, 0, 0};
    if (::sws_scale(scaler_, frame_->data, frame_->linesize, 0, height, rows.data(), steps.data()) != height)
      return false;
    image = wide == width ? whole : whole.colRange(0, width).clone();
    return true;
  }

  VideoPlace place_;
  AVFormatContext* input_ = nullptr;
  AVCodecContext* decoder_ = nullptr;
  AVPacket* packet_ = nullptr;
  AVFrame* frame_ = nullptr;
  SwsContext* scaler_ = nullptr;
  int stream_ = -1;
  bool stamped_ = true;
  Turn turn_of_all_;
  double tick_ = 0;  // s
  Time deadline_;
  std::string why_;
};

std::unique_ptr<Video> open_by_libav(const VideoPlace& place, std::string& why) {
  try {
    auto video = std::make_unique<LibavVideo>(place);
    if (video->open()) return video;
    why = video->why();
  } catch (const std::exception& failure) {
    why = failure.what();
  }
  return nullptr;
}

}  // namespace
}  // namespace pade::live

extern "C" __attribute__((visibility("default"))) const pade::live::VideoModule* pade_video_module() {
  static const pade::live::VideoModule kModule = {.open = pade::live::open_by_libav};
  return &kModule;
}
