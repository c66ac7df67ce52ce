#include "pade/live/recordings/session_recorder.hpp"

#include <limits>
#include <optional>
#include <system_error>
#include <utility>

#include <fmt/format.h>

#include "pade/io/recording/flight/flight_names.hpp"
#include "pade/io/recording/messages/message_writer.hpp"

namespace pade::live {
namespace {

namespace names = io::flight_names;

constexpr std::size_t kMostFrames = 30;  // that wait

/// What a file is called until it is finished.
std::filesystem::path part_of(std::filesystem::path file) {
  file += ".part";
  return file;
}

}  // namespace

namespace fs = std::filesystem;

std::uintmax_t RecorderLimits::space_beside(const fs::path& file) {
  std::error_code failed;
  const fs::space_info space = fs::space(fs::absolute(file, failed).parent_path(), failed);
  return failed ? std::numeric_limits<std::uintmax_t>::max() : space.available;  // then writing will say so
}

Result<std::unique_ptr<SessionRecorder>> SessionRecorder::create(const fs::path& file, const Camera& camera,
                                                                 const cv::Mat& mask,
                                                                 const RecorderLimits& limits) {
  std::unique_ptr<SessionRecorder> recorder(new SessionRecorder(file, camera, mask, limits));
  if (Status status = recorder->keep_earlier(); !status) return status.error();
  if (Status status = recorder->open(file); !status) return status.error();
  recorder->thread_ = std::thread([raw = recorder.get()] { raw->run(); });
  return recorder;
}

SessionRecorder::SessionRecorder(fs::path file, const Camera& camera, const cv::Mat& mask,
                                 const RecorderLimits& limits)
    : first_file_(std::move(file)),
      camera_(camera),
      mask_(mask.empty() ? cv::Mat(camera.size(), CV_8UC1, cv::Scalar(255)) : mask.clone()),
      limits_(limits) {}

SessionRecorder::~SessionRecorder() {
  if (thread_.joinable()) (void)finish();
}

RecorderReport SessionRecorder::report() const {
  const std::lock_guard lock(mutex_);
  return report_;
}

/// NAME-1.mcap, or the next that is neither there nor begun.
fs::path SessionRecorder::free_name(int from) const {
  std::error_code ignored;
  for (int number = from;; ++number) {
    fs::path file = first_file_;
    file.replace_filename(
        fmt::format("{}-{}{}", first_file_.stem().string(), number, first_file_.extension().string()));
    if (!fs::exists(file, ignored) && !fs::exists(part_of(file), ignored)) return file;
  }
}

/// A session that begins again, after a power cut or a crash, leaves what was recorded before it.
Status SessionRecorder::keep_earlier() {
  for (const bool finished : {true, false}) {
    const fs::path earlier = finished ? first_file_ : part_of(first_file_);
    std::error_code failed;
    if (!fs::is_regular_file(earlier, failed)) continue;
    const fs::path name = free_name(1);
    const fs::path kept = finished ? name : part_of(name);
    fs::rename(earlier, kept, failed);
    if (failed)
      return Error{fmt::format("{}: the recording of an earlier session cannot be moved to {}: {}",
                               earlier.string(), kept.filename().string(), failed.message())};
    report_.earlier.push_back(kept.string());
  }
  return {};
}

Status SessionRecorder::open(const fs::path& file) {
  {
    const std::lock_guard lock(mutex_);
    report_.file = file;
  }
  written_ = 0;
  if (limits_.available(file) < limits_.least_space) {
    end_for_want_of_space();
    return {};
  }
  auto writer = io::create_recording(file, io::Overwrite::refuse, true);
  if (!writer) return writer.error();
  writer_ = std::move(*writer);
  return {};
}

/// While there is room for the map, and for the end of the recording.
void SessionRecorder::end_for_want_of_space() {
  const Status ended = writer_ == nullptr ? Status() : end();
  const std::lock_guard lock(mutex_);
  report_.ended =
      fmt::format("the disk has less than {} MB left", (limits_.least_space + 999'999) / 1'000'000);
  if (!ended && written_ > 0) report_.ended += fmt::format("; {}", ended.error().message);
}

void SessionRecorder::fail(const Status& status) {
  if (status) return;
  const std::lock_guard lock(mutex_);
  status_ = status;
  report_.ended = status.error().message;
}

void SessionRecorder::take(const MapperInput& input) {
  const std::lock_guard lock(mutex_);
  if (waiting_.size() >= kMostFrames) {
    ++report_.left_out;
    return;
  }
  waiting_.push_back(std::make_unique<MapperInput>(input));
  come_.notify_one();
}

void SessionRecorder::begin_anew() {
  const std::lock_guard lock(mutex_);
  waiting_.push_back(nullptr);
  come_.notify_one();
}

Status SessionRecorder::finish() {
  if (thread_.joinable()) {
    {
      const std::lock_guard lock(mutex_);
      over_ = true;
      come_.notify_one();
    }
    thread_.join();
  }
  return status_;
}

void SessionRecorder::run() {
  const auto next = [&]() -> std::optional<std::unique_ptr<MapperInput>> {
    std::unique_lock lock(mutex_);
    come_.wait(lock, [&] { return over_ || !waiting_.empty(); });
    if (waiting_.empty()) return std::nullopt;
    auto input = std::move(waiting_.front());
    waiting_.pop_front();
    return input;
  };
  for (auto input = next(); input; input = next()) {
    const bool is_frame = *input != nullptr;
    if (report_.ended.empty() && is_frame && limits_.available(report_.file) < limits_.least_space)
      end_for_want_of_space();
    if (!report_.ended.empty()) {  // written by this thread alone
      const std::lock_guard lock(mutex_);
      report_.left_out += is_frame ? 1 : 0;
    } else if (is_frame) {
      fail(write(**input));
    } else if (written_ > 0) {
      Status status = writer_->finish();
      if (status) {
        ++finished_;
        last_file_ = report_.file;
        status = open(free_name(2));
      }
      fail(status);
    }
  }
  if (report_.ended.empty()) fail(end());
  if (!status_ || finished_ > 0) return;
  status_ = Error{report_.ended.empty()
                      ? fmt::format("{}: nothing was recorded", first_file_.string())
                      : fmt::format("{}: nothing was recorded: {}", first_file_.string(), report_.ended)};
}

/// The last file gets its name; one without a frame goes.
Status SessionRecorder::end() {
  if (written_ > 0) {
    Status status = writer_->finish();
    finished_ += status ? 1 : 0;
    return status;
  }
  writer_.reset();
  std::error_code failure;
  std::filesystem::remove(part_of(report_.file), failure);
  const std::lock_guard lock(mutex_);
  report_.file = last_file_;
  return {};
}

Status SessionRecorder::write_mask(Time time) {
  if (mask_.empty()) return {};
  return writer_->write(names::mask, "sensor_msgs/Image", time,
                        io::write_image({time, names::camera_frame}, mask_, writer_->encoding()));
}

Status SessionRecorder::write(const MapperInput& input) {
  const io::MessageHeader header{input.time, names::camera_frame};
  const io::MessageEncoding encoding = writer_->encoding();
  if (written_++ == 0) {
    if (Status status = write_mask(input.time); !status) return status;
  }
  Status status = writer_->write(names::camera_info, "sensor_msgs/CameraInfo", input.time,
                                 io::write_camera_info(header, camera_, encoding));
  if (status) {
    status = writer_->write(names::image, "sensor_msgs/Image", input.time,
                            io::write_image(header, input.image, encoding));
  }
  if (status) {
    status = writer_->write(names::odometry, "nav_msgs/Odometry", input.time,
                            io::write_odometry({input.time, names::world_frame}, names::camera_frame,
                                               input.T_world_camera, encoding));
  }
  if (!status) return status;
  return writer_->write(names::motion, "geometry_msgs/PoseWithCovarianceStamped", input.time,
                        io::write_pose_with_covariance({input.time, names::world_frame}, input.T_world_camera,
                                                       input.covariance, encoding));
}

}  // namespace pade::live
