#include "pade/live/recordings/session_recorder.hpp"

#include <optional>
#include <utility>

#include <fmt/format.h>

#include "pade/io/recording/flight/flight_names.hpp"
#include "pade/io/recording/messages/message_writer.hpp"

namespace pade::live {
namespace {

namespace names = io::flight_names;

constexpr std::size_t kMostFrames = 30;  // that wait

}  // namespace

Result<std::unique_ptr<SessionRecorder>> SessionRecorder::create(const std::filesystem::path& file,
                                                                 const Camera& camera, const cv::Mat& mask) {
  std::unique_ptr<SessionRecorder> recorder(new SessionRecorder(file, camera, mask));
  if (Status status = recorder->open(); !status) return status.error();
  recorder->thread_ = std::thread([raw = recorder.get()] { raw->run(); });
  return recorder;
}

SessionRecorder::SessionRecorder(std::filesystem::path file, const Camera& camera, const cv::Mat& mask)
    : first_file_(std::move(file)),
      camera_(camera),
      mask_(mask.empty() ? cv::Mat(camera.size(), CV_8UC1, cv::Scalar(255)) : mask.clone()) {}

SessionRecorder::~SessionRecorder() {
  if (thread_.joinable()) (void)finish();
}

std::filesystem::path SessionRecorder::file() const {
  if (part_ == 1) return first_file_;
  std::filesystem::path file = first_file_;
  file.replace_filename(
      fmt::format("{}-{}{}", first_file_.stem().string(), part_, first_file_.extension().string()));
  return file;
}

std::size_t SessionRecorder::left_out() const {
  const std::lock_guard lock(mutex_);
  return left_out_;
}

Status SessionRecorder::open() {
  auto writer = io::create_recording(file(), io::Overwrite::replace, true);
  if (!writer) return writer.error();
  writer_ = std::move(*writer);
  written_ = 0;
  return {};
}

void SessionRecorder::take(const MapperInput& input) {
  const std::lock_guard lock(mutex_);
  if (waiting_.size() >= kMostFrames) {
    ++left_out_;
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
    if (!status_) continue;
    if (*input != nullptr) {
      status_ = write(**input);
    } else if (written_ > 0) {
      status_ = writer_->finish();
      ++part_;
      if (status_) status_ = open();
    }
  }
  if (status_) status_ = end();
}

/// The last file gets its name; one without a frame goes.
Status SessionRecorder::end() {
  if (written_ > 0) return writer_->finish();
  std::filesystem::path part = file();
  part += ".part";
  writer_.reset();
  std::error_code failure;
  std::filesystem::remove(part, failure);
  if (part_ == 1) return Error{fmt::format("{}: nothing was recorded", file().string())};
  --part_;
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
