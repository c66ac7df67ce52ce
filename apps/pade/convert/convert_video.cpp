#include "convert/convert_video.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <string_view>

#include <fmt/format.h>

#include "pade/io/atomic_output.hpp"
#include "pade/io/image/image_codec.hpp"
#include "pade/io/sequence/calibration.hpp"
#include "pade/io/text.hpp"
#include "pade/live/camera/video_module.hpp"
#include "pade/live/camera/video_source.hpp"

#include "convert/flight_folder.hpp"
#include "progress.hpp"

namespace pade::cli {
namespace {

namespace fs = std::filesystem;

constexpr std::array<std::string_view, 10> kVideoEndings = {".mp4",  ".mov", ".m4v",  ".mkv", ".avi",
                                                            ".webm", ".mpg", ".mpeg", ".ts",  ".mjpeg"};

Result<Camera> copy_calibration(const VideoConversion& conversion, const io::OutputFolder& folder) {
  if (conversion.calibration.empty())
    return Error{
        fmt::format("{}: a video says nothing of its lens, expected --calibration FILE", conversion.in)};
  const auto calibration = io::read_calibration(conversion.calibration, conversion.camera);
  if (!calibration) return calibration.error();
  const auto text = io::read_file(conversion.calibration);
  if (!text) return text.error();
  const std::string head = fmt::format("{} convert: of {}\n{} rgb {}\n", kFlightWords, conversion.in,
                                       io::flight_files_line, kFlightMarker);
  if (const Status status = folder.write(kFlightMarker, head + *text); !status) return status.error();
  const auto place = folder.place(kFlightMarker);
  if (!place) return place.error();
  const auto copied = io::read_calibration(*place);
  if (!copied || copied->camera != calibration->camera)
    return Error{
        fmt::format("{}: found a calibration that cannot be called camera.yaml, expected the fields of "
                    "docs/sequences.md",
                    conversion.calibration)};
  if (!calibration->camera)
    return Error{fmt::format("{}: found no lens, expected fx, fy, cx, cy", conversion.calibration)};
  return *calibration->camera;
}

struct Frames {
  std::size_t written = 0, unusable = 0, of_other_size = 0, not_later = 0;
  std::optional<double> first, last;  // s, by the video
};

Status write_frames(live::Video& video, const VideoConversion& conversion, const Camera& camera,
                    const io::OutputFolder& folder, Frames& frames) {
  Progress progress("Converting", 0);
  live::VideoFrame frame;
  while (true) {
    if (io::interrupted()) return io::interrupted_error();
    const live::Video::Read read = video.next(frame);
    if (read == live::Video::Read::ended) return {};
    if (read == live::Video::Read::failed) return Error{fmt::format("{}: {}", conversion.in, video.why())};
    if (read == live::Video::Read::unusable) {
      ++frames.unusable;
      continue;
    }
    if (frame.image.cols != camera.width || frame.image.rows != camera.height) {
      if (frames.written == 0)
        return Error{fmt::format("{}: gives {} x {}, expected the calibration's {} x {}", conversion.in,
                                 frame.image.cols, frame.image.rows, camera.width, camera.height)};
      ++frames.of_other_size;
      continue;
    }
    if (frames.last && frame.seconds <= *frames.last) {
      ++frames.not_later;
      continue;
    }
    if (!frames.first) frames.first = frame.seconds;
    frames.last = frame.seconds;
    const Time time{conversion.start.nanoseconds + std::llround(1e9 * (frame.seconds - *frames.first))};
    const auto png = io::encode_png(frame.image);
    if (const Status status = folder.write(fmt::format("rgb/{}.png", to_string(time)), png); !status)
      return status;
    progress.show(++frames.written, fmt::format("{:.1f} s", frame.seconds - *frames.first));
  }
}

}  // namespace

bool is_video(const fs::path& file) {
  std::string ending = file.extension().string();
  std::transform(ending.begin(), ending.end(), ending.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return std::find(kVideoEndings.begin(), kVideoEndings.end(), ending) != kVideoEndings.end();
}

Status convert_video(const VideoConversion& conversion) {
  if (fs::path(conversion.out).has_extension())
    return Error{
        fmt::format("{}: found an ending, expected a folder: a video has no poses, which a recording "
                    "of a flight needs",
                    conversion.out)};
  const auto& library = live::video_module();
  if (!library) return Error{fmt::format("{}: {}", conversion.in, library.error().message)};
  if (conversion.force) {
    if (Status own = check_own_flight(conversion.out); !own) return own;
  }
  const auto overwrite = conversion.force ? io::Overwrite::replace : io::Overwrite::refuse;
  auto folder = io::OutputFolder::create(conversion.out, overwrite, kFlightMarker);
  if (!folder) return folder.error();
  const auto camera = copy_calibration(conversion, *folder);
  if (!camera) return camera.error();
  std::string why;
  const auto video = (*library)->open({conversion.in, false, 0, nullptr, nullptr}, why);
  if (video == nullptr)
    return Error{fmt::format("{}: {}; expected a video that can be read", conversion.in, why)};
  Frames frames;
  if (const Status status = write_frames(*video, conversion, *camera, *folder, frames); !status)
    return status;
  if (frames.written == 0)
    return Error{fmt::format("{}: found no frame that can be decoded and has a stamp, expected a video",
                             conversion.in)};
  if (const Status status = folder->commit(); !status) return status;
  const auto left_out = [](std::size_t count, std::string_view what) {
    if (count > 0) fmt::print("left out: {} frames {}\n", count, what);
  };
  left_out(frames.unusable, "that are damaged or have no stamp");
  left_out(frames.of_other_size, "of another size");
  left_out(frames.not_later, "that are not later than the one before");
  fmt::print(
      "note: the first frame is at {} s; where a log has another clock, `pade calibrate time` finds the "
      "offset\n",
      to_string(conversion.start));
  fmt::print("{} images of {:.2f} s in {}\n", frames.written, *frames.last - *frames.first, conversion.out);
  return {};
}

}  // namespace pade::cli
