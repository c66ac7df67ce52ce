// The module for videos: FFmpeg's libraries, and with them some eighty more, which the program loads when a
// video is asked for. Nothing else links them.
#include <algorithm>
#include <array>
#include <chrono>
#include <exception>

#include "pade/live/camera/video_module.hpp"

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
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
    if (const int found = ::avformat_find_stream_info(input_, nullptr); found < 0) return fail(reason(found));
    const AVCodec* codec = nullptr;
    stream_ = ::av_find_best_stream(input_, AVMEDIA_TYPE_VIDEO, -1, -1, &codec, 0);
    if (stream_ < 0 || codec == nullptr) return fail("found no pictures in it that can be decoded");
    decoder_ = ::avcodec_alloc_context3(codec);
    if (decoder_ == nullptr) return fail("no memory");
    const AVStream& stream = *input_->streams[stream_];
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
      if (got == 0) return take(frame) ? Read::frame : Read::unusable;
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

  bool take(VideoFrame& out) {
    const bool damaged = (frame_->flags & AV_FRAME_FLAG_CORRUPT) != 0 || frame_->decode_error_flags != 0;
    const std::int64_t stamp = frame_->best_effort_timestamp;
    const bool good = !damaged && stamp != AV_NOPTS_VALUE && convert(out.image);
    out.seconds = static_cast<double>(stamp) * tick_;
    out.arrived = {frame_->reordered_opaque};
    ::av_frame_unref(frame_);
    return good;
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
    try {
      image = cv::Mat(height, width, grey ? CV_8UC1 : CV_8UC3);
    } catch (const std::exception&) {
      return false;
    }
    std::array<std::uint8_t*, 4> rows{image.data, nullptr, nullptr, nullptr};
    const std::array<int, 4> steps{static_cast<int>(image.step), 0, 0, 0};
    return ::sws_scale(scaler_, frame_->data, frame_->linesize, 0, height, rows.data(), steps.data()) ==
           height;
  }

  VideoPlace place_;
  AVFormatContext* input_ = nullptr;
  AVCodecContext* decoder_ = nullptr;
  AVPacket* packet_ = nullptr;
  AVFrame* frame_ = nullptr;
  SwsContext* scaler_ = nullptr;
  int stream_ = -1;
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
