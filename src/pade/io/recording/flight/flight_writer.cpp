#include "pade/io/recording/flight/flight_writer.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <GeographicLib/LocalCartesian.hpp>
#include <fmt/format.h>

#include "pade/core/version.hpp"
#include "pade/io/navigation/geodetic_fixes.hpp"
#include "pade/io/navigation/navigation_log.hpp"
#include "pade/io/recording/messages/message_writer.hpp"
#include "pade/io/sequence/image_file.hpp"

namespace pade::io {
namespace {

namespace names = flight_names;

/// One thing to be written, in the order of time.
struct Item {
  enum class Kind : std::uint8_t { image, pose, imu, fix, velocity, field, height };
  Time time;
  Kind kind;
  std::size_t index;
};

template <class Values>
void list(std::vector<Item>& items, const Values& values, Item::Kind kind) {
  for (std::size_t i = 0; i < values.size(); ++i) items.push_back({values[i].time, kind, i});
}

/// The offset between the clocks is taken out of the poses, so that nobody has to know of it.
Time pose_time(const Sequence& sequence, Time row) {
  const Time offset = Time::from_seconds(sequence.calibration().time_offset_s.value_or(0));
  return sequence.poses_computed() ? row : Time{row.nanoseconds - offset.nanoseconds};
}

/// What stays behind, as sentences.
std::vector<std::string> left_out(const Sequence& sequence) {
  std::vector<std::string> out;
  if (sequence.has_truth()) out.emplace_back("the true depth");
  if (sequence.size() < sequence.listed_frames()) {
    out.push_back(fmt::format("{} of {} frames, which pade map leaves out as well",
                              sequence.listed_frames() - sequence.size(), sequence.listed_frames()));
  }
  if (sequence.mask_is_stated()) out.emplace_back("mask.png");
  return out;
}

/// Writes one flight into one recording.
class FlightWriter {
 public:
  FlightWriter(const Sequence& sequence, const NavigationLog* log, RecordingWriter& writer)
      : sequence_(sequence), log_(log), writer_(writer), encoding_(writer.encoding()) {}

  Result<WrittenFlight> write(const FlightProgress& progress) {
    written_.left_out = left_out(sequence_);
    const Calibration& calibration = sequence_.calibration();
    if (calibration.intensity) written_.left_out.emplace_back("intensity_range: give it by --calibration");
    if (calibration.world_up)
      written_.left_out.emplace_back("world_up: give it by --world-up or --calibration");
    if (calibration.origin) written_.left_out.emplace_back("geographic_origin");
    const std::vector<Item> items = in_order_of_time();
    if (Status status = write_mounting(items.front().time); !status) return status.error();
    for (const Item& item : items) {
      if (item.kind == Item::Kind::image && progress && !progress(written_.images))
        return interrupted_error();
      if (Status status = write(item); !status) return status.error();
    }
    return written_;
  }

 private:
  [[nodiscard]] std::vector<Item> in_order_of_time() const {
    std::vector<Item> items;
    for (std::size_t i = 0; i < sequence_.size(); ++i)
      items.push_back({sequence_.time(i), Item::Kind::image, i});
    const auto& rows = sequence_.trajectory().rows();
    for (std::size_t i = 0; i < rows.size(); ++i)
      items.push_back({pose_time(sequence_, rows[i].time), Item::Kind::pose, i});
    if (log_ != nullptr) {
      list(items, log_->imu, Item::Kind::imu);
      list(items, log_->gnss.fixes, Item::Kind::fix);
      list(items, log_->gnss.velocities, Item::Kind::velocity);
      list(items, log_->magnetometer, Item::Kind::field);
      list(items, log_->barometer, Item::Kind::height);
    }
    std::stable_sort(items.begin(), items.end(),
                     [](const Item& a, const Item& b) { return a.time < b.time; });
    // Recordings know no time before 1970.
    std::erase_if(items, [](const Item& item) { return item.time.nanoseconds < 0; });
    return items;
  }

  Status write_mounting(Time start) {
    const Calibration& calibration = sequence_.calibration();
    const MessageHeader header{start, names::body_frame};
    Status status;
    if (calibration.T_body_camera) {
      status =
          writer_.write(names::transforms, "tf2_msgs/TFMessage", start,
                        write_transform(header, names::camera_frame, *calibration.T_body_camera, encoding_));
    }
    const bool from_log = log_ != nullptr && log_->gnss.lever_arm.has_value();
    if (status && (from_log || calibration.gnss_lever_arm)) {
      const Pose antenna{Eigen::Quaterniond::Identity(),
                         from_log ? *log_->gnss.lever_arm : *calibration.gnss_lever_arm};
      status = writer_.write(names::transforms, "tf2_msgs/TFMessage", start,
                             write_transform(header, "gps", antenna, encoding_));
    }
    return status;
  }

  Status write(const Item& item) {
    const MessageHeader body{item.time, names::body_frame};
    switch (item.kind) {
      case Item::Kind::image:
        return write_image_of(item);
      case Item::Kind::pose:
        ++written_.poses;
        return writer_.write(
            names::odometry, "nav_msgs/Odometry", item.time,
            write_odometry({item.time, names::world_frame},
                           sequence_.poses_of_body() ? names::body_frame : names::camera_frame,
                           sequence_.trajectory().rows()[item.index].pose, encoding_));
      case Item::Kind::imu: {
        const ImuSample& sample = log_->imu[item.index];
        ++written_.imu;
        return writer_.write(names::imu, "sensor_msgs/Imu", item.time,
                             write_imu(body, sample.angular_rate, sample.specific_force, encoding_));
      }
      case Item::Kind::fix:
        return write_fix(item);
      case Item::Kind::velocity: {
        const GnssVelocity& velocity = log_->gnss.velocities[item.index];
        return writer_.write(
            names::velocity, "geometry_msgs/TwistWithCovarianceStamped", item.time,
            write_velocity({item.time, "gps"}, velocity.velocity, velocity.covariance, encoding_));
      }
      case Item::Kind::field: {
        constexpr double kTeslaPerGauss = 1e-4;
        return writer_.write(
            names::field, "sensor_msgs/MagneticField", item.time,
            write_magnetic_field(body, kTeslaPerGauss * log_->magnetometer[item.index].field, encoding_));
      }
      case Item::Kind::height:
        return writer_.write(
            names::pressure, "sensor_msgs/FluidPressure", item.time,
            write_pressure(body, 100 * pressure_at_height(log_->barometer[item.index].height), encoding_));
    }
    return {};
  }

  Status write_image_of(const Item& item) {
    const MessageHeader header{item.time, names::camera_frame};
    const Status status = writer_.write(names::camera_info, "sensor_msgs/CameraInfo", item.time,
                                        write_camera_info(header, sequence_.raw_camera(), encoding_));
    if (!status) return status;
    auto image = sequence_.encoded_image(item.index);
    if (!image) return image.error();
    ++written_.images;
    const bool png = image->bytes.starts_with("\x89PNG");
    if (png || image->bytes.starts_with("\xFF\xD8\xFF")) {
      return writer_.write(names::compressed, "sensor_msgs/CompressedImage", item.time,
                           write_compressed_image(header, png ? "png" : "jpeg", image->bytes, encoding_));
    }
    const auto pixels = read_image_bytes(image->bytes, sequence_.image_file(item.index).string());
    if (!pixels) return pixels.error();
    return writer_.write(names::image, "sensor_msgs/Image", item.time,
                         write_image(header, *pixels, encoding_));
  }

  Status write_fix(const Item& item) {
    const GnssFix& fix = log_->gnss.fixes[item.index];
    const GeodeticOrigin origin = log_->gnss.origin.value_or(GeodeticOrigin{});
    const GeographicLib::LocalCartesian frame(origin.latitude, origin.longitude, origin.height);
    Eigen::Vector3d place;
    frame.Reverse(fix.position.x(), fix.position.y(), fix.position.z(), place.x(), place.y(), place.z());
    ++written_.fixes;
    return writer_.write(names::fix, "sensor_msgs/NavSatFix", item.time,
                         write_nav_sat_fix({item.time, "gps"}, place, fix.covariance, encoding_));
  }

  const Sequence& sequence_;
  const NavigationLog* log_;
  RecordingWriter& writer_;
  MessageEncoding encoding_;
  WrittenFlight written_;
};

std::string camera_yaml(const Sequence& sequence) {
  const Camera& camera = sequence.raw_camera();
  const Calibration& calibration = sequence.calibration();
  std::string text = fmt::format(
      "# written by pade {}\nwidth: {}\nheight: {}\nfx: {}\nfy: {}\ncx: {}\ncy: {}\ndistortion_model: {}\n",
      version, camera.width, camera.height, camera.fx, camera.fy, camera.cx, camera.cy,
      lens_name(camera.distortion));
  if (camera.distortion != Distortion::none) {
    const std::size_t count = camera.distortion == Distortion::plumb_bob     ? 5
                              : camera.distortion == Distortion::equidistant ? 4
                                                                             : 8;
    text += fmt::format(
        "distortion: [{}]\n",
        fmt::join(camera.coefficients.begin(), camera.coefficients.begin() + static_cast<long>(count), ", "));
  }
  text += fmt::format("pose_convention: {}\n",
                      sequence.poses_of_body() ? "body_to_world" : "camera_to_world_optical");
  if (calibration.T_body_camera) {
    const Eigen::Matrix3d r = calibration.T_body_camera->matrix3();
    const Eigen::Vector3d& t = calibration.T_body_camera->translation;
    text += "T_body_camera:";
    for (int i = 0; i < 3; ++i)
      text += fmt::format("{}{}, {}, {}, {}", i == 0 ? " [" : ", ", r(i, 0), r(i, 1), r(i, 2), t(i));
    text += ", 0, 0, 0, 1]\n";
  }
  if (calibration.intensity)
    text +=
        fmt::format("intensity_range: [{}, {}]\n", (*calibration.intensity)[0], (*calibration.intensity)[1]);
  if (const auto& up = sequence.world_up(); up && up->stated)
    text += fmt::format("world_up: \"{} {} {}\"\n", up->direction.x(), up->direction.y(), up->direction.z());
  if (calibration.gnss_lever_arm) {
    const Eigen::Vector3d& arm = *calibration.gnss_lever_arm;
    text += fmt::format("gnss_lever_arm: [{}, {}, {}]\n", arm.x(), arm.y(), arm.z());
  }
  return text;
}

/// The sensors as the project's own tables.
Status write_tables(const NavigationLog& log, const OutputFolder& folder) {
  if (Status status = folder.write("imu.csv", format_imu(log.imu)); !status) return status;
  if (Status status = folder.write("gnss.csv", format_gnss(log.gnss)); !status) return status;
  if (!log.barometer.empty()) {
    std::string text = "t_s,height_m,sigma_m\n";
    for (const BarometricHeight& h : log.barometer)
      text += fmt::format("{},{},{}\n", to_string(h.time), h.height, h.sigma);
    if (Status status = folder.write("baro.csv", text); !status) return status;
  }
  if (log.magnetometer.empty()) return {};
  std::string text = "# frame=FLU\nt_s,mx,my,mz\n";
  for (const MagneticField& m : log.magnetometer)
    text += fmt::format("{},{},{},{}\n", to_string(m.time), m.field.x(), m.field.y(), m.field.z());
  return folder.write("mag.csv", text);
}

}  // namespace

Result<WrittenFlight> write_flight(const Sequence& sequence, const NavigationLog* log,
                                   RecordingWriter& writer, const FlightProgress& progress) {
  auto written = FlightWriter(sequence, log, writer).write(progress);
  if (!written) return written;
  if (Status status = writer.finish(); !status) return status.error();
  return written;
}

Result<WrittenFlight> write_flight(const Sequence& sequence, const NavigationLog* log,
                                   const OutputFolder& folder, const FlightProgress& progress) {
  WrittenFlight written;
  written.left_out = left_out(sequence);
  for (std::size_t i = 0; i < sequence.size(); ++i) {
    if (progress && !progress(i)) return interrupted_error();
    const auto image = sequence.encoded_image(i);
    if (!image) return image.error();
    const std::string name = fmt::format("rgb/{}{}", to_string(sequence.time(i)), image->ending);
    if (Status status = folder.write(name, image->bytes); !status) return status.error();
    ++written.images;
  }
  std::vector<StampedPose> rows = sequence.trajectory().rows();
  for (StampedPose& row : rows) row.time = pose_time(sequence, row.time);
  written.poses = rows.size();
  if (Status status = folder.write("camera.yaml", camera_yaml(sequence)); !status) return status.error();
  if (Status status = folder.write("groundtruth.txt", format_trajectory(rows)); !status)
    return status.error();
  if (log != nullptr) {
    written.imu = log->imu.size();
    written.fixes = log->gnss.fixes.size();
    if (Status status = write_tables(*log, folder); !status) return status.error();
  }
  return written;
}

}  // namespace pade::io
