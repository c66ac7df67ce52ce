#include "pade/io/recording/flight/flight_writer.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <span>
#include <string_view>
#include <utility>

#include <GeographicLib/LocalCartesian.hpp>
#include <fmt/format.h>

#include "pade/core/version.hpp"
#include "pade/io/image/image_codec.hpp"
#include "pade/io/navigation/geodetic_fixes.hpp"
#include "pade/io/navigation/navigation_log.hpp"
#include "pade/io/recording/messages/message_writer.hpp"
#include "pade/io/sequence/image_file.hpp"
#include "pade/io/text.hpp"

namespace pade::io {
namespace {

namespace names = flight_names;

/// One thing to be written, in the order of time.
struct Item {
  enum class Kind : std::uint8_t { image, pose, motion, imu, fix, velocity, field, height };
  Time time;
  Kind kind;
  std::size_t index;
};

template <class Values>
void list(std::vector<Item>& items, const Values& values, Item::Kind kind) {
  for (std::size_t i = 0; i < values.size(); ++i) items.push_back({values[i].time, kind, i});
}

Time clock_offset(const Sequence& sequence) {
  return Time::from_seconds(sequence.calibration().time_offset_s.value_or(0));
}

/// The offset between the clocks is taken out of poses and sensors, so that nobody has to know of it.
Time pose_time(const Sequence& sequence, Time row) {
  return sequence.poses_computed() ? row : Time{row.nanoseconds - clock_offset(sequence).nanoseconds};
}

/// The sensors on the clock of the images.
NavigationLog on_clock_of_images(NavigationLog log, Time offset) {
  const auto shift = [&](auto& samples) {
    for (auto& sample : samples) sample.time.nanoseconds -= offset.nanoseconds;
  };
  shift(log.imu);
  shift(log.gnss.fixes);
  shift(log.gnss.velocities);
  shift(log.magnetometer);
  shift(log.barometer);
  return log;
}

/// How the IMU sits on the body of the poses; empty where it is the body, or nobody knows.
std::optional<Pose> imu_on_body(const Sequence& sequence) {
  const auto& T_body_camera = sequence.calibration().T_body_camera;
  const auto& T_imu_camera = sequence.T_imu_camera();
  if (!T_body_camera || !T_imu_camera) return std::nullopt;
  constexpr double kSame = 1e-9;
  const Pose T_body_imu = *T_body_camera * T_imu_camera->inverse();
  if (T_body_imu.translation.norm() < kSame && T_body_imu.rotation.vec().norm() < kSame) return std::nullopt;
  return T_body_imu;
}

/// How the camera sits on the body of the poses, else on the IMU.
std::optional<Pose> camera_on_body(const Sequence& sequence) {
  const auto& T_body_camera = sequence.calibration().T_body_camera;
  return T_body_camera ? T_body_camera : sequence.T_imu_camera();
}

bool has_motions(const Sequence& sequence) {
  for (std::size_t i = 0; i < sequence.size(); ++i)
    if (!sequence.motion_covariance(i).isZero(0)) return true;
  return false;
}

/// What stays behind, as sentences.
std::vector<std::string> left_out(const Sequence& sequence) {
  std::vector<std::string> out;
  if (sequence.has_truth()) out.emplace_back("the true depth");
  if (sequence.size() < sequence.listed_frames()) {
    out.push_back(fmt::format("{} of {} frames, which pade map leaves out as well",
                              sequence.listed_frames() - sequence.size(), sequence.listed_frames()));
  }
  return out;
}

/// What became something else.
std::vector<std::string> changed(const Sequence& sequence, const NavigationLog* log) {
  std::vector<std::string> notes;
  const Time offset = clock_offset(sequence);
  if (offset.nanoseconds != 0 && (log != nullptr || !sequence.poses_computed())) {
    notes.push_back(
        fmt::format("the offset of {} s between the clocks (time_offset_s) is taken out of the {}{}",
                    to_string(offset), sequence.poses_computed() ? "" : "poses",
                    log == nullptr              ? ""
                    : sequence.poses_computed() ? "sensors"
                                                : " and the sensors"));
  }
  return notes;
}

/// What a magnetometer's numbers have to be multiplied by for tesla. Their unit is stated nowhere: the
/// Earth's field, 22 to 67 millionths of a tesla, tells the usual ones apart. Empty: none of them fits.
struct MagneticUnit {
  const char* name;
  double tesla;
};
std::optional<MagneticUnit> unit_of(const std::vector<MagneticField>& samples) {
  constexpr MagneticUnit kUnits[] = {
      {"tesla", 1}, {"gauss", 1e-4}, {"microtesla", 1e-6}, {"milligauss", 1e-7}, {"nanotesla", 1e-9}};
  constexpr double kLeast = 15e-6, kMost = 100e-6;  // T, with what iron nearby adds or takes
  std::vector<double> sizes;
  for (const MagneticField& sample : samples)
    if (sample.field.allFinite()) sizes.push_back(sample.field.norm());
  if (sizes.empty()) return std::nullopt;
  const auto middle = sizes.begin() + static_cast<std::ptrdiff_t>(sizes.size() / 2);
  std::nth_element(sizes.begin(), middle, sizes.end());
  for (const MagneticUnit& unit : kUnits)
    if (*middle * unit.tesla >= kLeast && *middle * unit.tesla <= kMost) return unit;
  return std::nullopt;
}

/// Writes one flight into one recording.
class FlightWriter {
 public:
  FlightWriter(const Sequence& sequence, const NavigationLog* log, RecordingWriter& writer)
      : sequence_(sequence),
        T_body_imu_(imu_on_body(sequence)),
        writer_(writer),
        encoding_(writer.encoding()) {
    if (log != nullptr) log_ = on_clock_of_images(*log, clock_offset(sequence));
    imu_frame_ = T_body_imu_ ? names::imu_frame : names::body_frame;
    written_.notes = changed(sequence, log);
    if (!log_.gnss.fixes.empty() && !log_.gnss.origin) {
      written_.notes.emplace_back(
          "the GNSS positions state no origin on Earth (gnss.csv: # origin=LATITUDE,LONGITUDE,HEIGHT): they "
          "are written as if their 0 0 0 lay at latitude 0, longitude 0, height 0");
    }
    if (log_.magnetometer.empty()) return;
    constexpr MagneticUnit kGauss{"gauss", 1e-4};
    const auto unit = unit_of(log_.magnetometer);
    tesla_ = unit.value_or(kGauss).tesla;
    if (!unit) {
      written_.notes.emplace_back(
          "the unit of the magnetic field is not known, since it is not as strong as the Earth's in tesla, "
          "gauss, microtesla, milligauss or nanotesla: it is written as if in gauss");
    } else if (unit->tesla != kGauss.tesla) {
      written_.notes.push_back(fmt::format(
          "the magnetic field is as strong as the Earth's in {}: it is taken for that", unit->name));
    }
  }

  Result<WrittenFlight> write(const FlightProgress& progress) {
    written_.left_out = left_out(sequence_);
    const Calibration& calibration = sequence_.calibration();
    if (calibration.intensity) written_.left_out.emplace_back("intensity_range: give it by --calibration");
    if (calibration.world_up)
      written_.left_out.emplace_back("world_up: give it by --world-up or --calibration");
    if (calibration.origin) written_.left_out.emplace_back("geographic_origin");
    const auto items = in_order_of_time();
    if (!items) return items.error();
    const Time start = items->front().time;
    if (Status status = write_mounting(start); !status) return status.error();
    if (sequence_.mask_is_stated()) {
      const Status status =
          writer_.write(names::mask, "sensor_msgs/Image", start,
                        write_image({start, names::camera_frame}, sequence_.mask(), encoding_));
      if (!status) return status.error();
    }
    for (const Item& item : *items) {
      if (item.kind == Item::Kind::image && progress && !progress(written_.images))
        return interrupted_error();
      if (Status status = write(item); !status) return status.error();
    }
    return written_;
  }

 private:
  /// Recordings know the times from 1970 to 2038.
  static bool has_time(Time time) {
    constexpr std::int64_t kEnd = 2'147'483'648'000'000'000;
    return time.nanoseconds >= 0 && time.nanoseconds < kEnd;
  }

  Result<std::vector<Item>> in_order_of_time() {
    std::vector<Item> items;
    const bool motions = has_motions(sequence_);
    for (std::size_t i = 0; i < sequence_.size(); ++i) {
      if (!has_time(sequence_.time(i))) {
        return Error{
            fmt::format("{}: the image's time is {} s, expected one from 1970 to 2038, as recordings count: "
                        "shift the times of the flight, or write a folder",
                        sequence_.image_file(i).string(), to_string(sequence_.time(i)))};
      }
      items.push_back({sequence_.time(i), Item::Kind::image, i});
      if (motions) items.push_back({sequence_.time(i), Item::Kind::motion, i});
    }
    const auto& rows = sequence_.trajectory().rows();
    for (std::size_t i = 0; i < rows.size(); ++i)
      items.push_back({pose_time(sequence_, rows[i].time), Item::Kind::pose, i});
    list(items, log_.imu, Item::Kind::imu);
    list(items, log_.gnss.fixes, Item::Kind::fix);
    list(items, log_.gnss.velocities, Item::Kind::velocity);
    list(items, log_.magnetometer, Item::Kind::field);
    list(items, log_.barometer, Item::Kind::height);
    std::stable_sort(items.begin(), items.end(),
                     [](const Item& a, const Item& b) { return a.time < b.time; });
    const auto count = std::erase_if(items, [](const Item& item) { return !has_time(item.time); });
    if (count > 0) {
      written_.left_out.push_back(fmt::format(
          "{} poses and samples whose times are not between 1970 and 2038, as recordings count", count));
    }
    return items;
  }

  Status write_mounting(Time start) {
    const Calibration& calibration = sequence_.calibration();
    std::vector<NamedTransform> mounting;
    const auto sits = [&](const char* child, const char* parent, const Pose& pose) {
      mounting.push_back({{start, parent}, child, pose});
    };
    if (const auto camera = camera_on_body(sequence_)) sits(names::camera_frame, names::body_frame, *camera);
    if (T_body_imu_) sits(names::imu_frame, names::body_frame, *T_body_imu_);
    if (log_.gnss.lever_arm) {
      sits("gps", imu_frame_, {Eigen::Quaterniond::Identity(), *log_.gnss.lever_arm});
    } else if (calibration.gnss_lever_arm) {
      sits("gps", names::body_frame, {Eigen::Quaterniond::Identity(), *calibration.gnss_lever_arm});
    }
    for (const NamedTransform& one : mounting) {
      const Status status = writer_.write(names::transforms, "tf2_msgs/TFMessage", start,
                                          write_transform(one.header, one.child, one.pose, encoding_));
      if (!status) return status;
    }
    return {};
  }

  Status write(const Item& item) {
    const MessageHeader body{item.time, imu_frame_};
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
      case Item::Kind::motion:
        return writer_.write(
            names::motion, "geometry_msgs/PoseWithCovarianceStamped", item.time,
            write_pose_with_covariance({item.time, names::world_frame}, sequence_.pose(item.index),
                                       sequence_.motion_covariance(item.index), encoding_));
      case Item::Kind::imu: {
        const ImuSample& sample = log_.imu[item.index];
        ++written_.imu;
        return writer_.write(names::imu, "sensor_msgs/Imu", item.time,
                             write_imu(body, sample.angular_rate, sample.specific_force, encoding_));
      }
      case Item::Kind::fix:
        return write_fix(item);
      case Item::Kind::velocity: {
        const GnssVelocity& velocity = log_.gnss.velocities[item.index];
        return writer_.write(
            names::velocity, "geometry_msgs/TwistWithCovarianceStamped", item.time,
            write_velocity({item.time, "gps"}, velocity.velocity, velocity.covariance, encoding_));
      }
      case Item::Kind::field: {
        return writer_.write(
            names::field, "sensor_msgs/MagneticField", item.time,
            write_magnetic_field(body, tesla_ * log_.magnetometer[item.index].field, encoding_));
      }
      case Item::Kind::height:
        return writer_.write(
            names::pressure, "sensor_msgs/FluidPressure", item.time,
            write_pressure(body, 100 * pressure_at_height(log_.barometer[item.index].height), encoding_));
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
    const GnssFix& fix = log_.gnss.fixes[item.index];
    const GeodeticOrigin origin = log_.gnss.origin.value_or(GeodeticOrigin{});
    const GeographicLib::LocalCartesian frame(origin.latitude, origin.longitude, origin.height);
    Eigen::Vector3d place;
    frame.Reverse(fix.position.x(), fix.position.y(), fix.position.z(), place.x(), place.y(), place.z());
    ++written_.fixes;
    return writer_.write(names::fix, "sensor_msgs/NavSatFix", item.time,
                         write_nav_sat_fix({item.time, "gps"}, place, fix.covariance, encoding_));
  }

  const Sequence& sequence_;
  std::optional<Pose> T_body_imu_;
  const char* imu_frame_ = names::body_frame;
  NavigationLog log_;
  RecordingWriter& writer_;
  MessageEncoding encoding_;
  double tesla_ = 1e-4;  // of a unit of the magnetometer
  WrittenFlight written_;
};

/// @param files  of the flight, separated by blanks
std::string camera_yaml(const Sequence& sequence, std::string_view files) {
  const Camera& camera = sequence.raw_camera();
  const Calibration& calibration = sequence.calibration();
  std::string text = fmt::format(
      "# written by pade {}\n{}{}\nwidth: {}\nheight: {}\nfx: {}\nfy: {}\ncx: {}\ncy: {}\n"
      "distortion_model: {}\n",
      version, flight_files_line, files, camera.width, camera.height, camera.fx, camera.fy, camera.cx,
      camera.cy, lens_name(camera.distortion));
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
  if (const auto T_body_camera = camera_on_body(sequence)) {
    const Eigen::Matrix3d r = T_body_camera->matrix3();
    const Eigen::Vector3d& t = T_body_camera->translation;
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
  if (calibration.origin) {
    const auto& origin = *calibration.origin;
    text += fmt::format("geographic_origin: [{}, {}, {}]\n", origin.latitude_deg, origin.longitude_deg,
                        origin.height);
  }
  if (calibration.gnss_lever_arm) {
    const Eigen::Vector3d& arm = *calibration.gnss_lever_arm;
    text += fmt::format("gnss_lever_arm: [{}, {}, {}]\n", arm.x(), arm.y(), arm.z());
  }
  return text;
}

/// Sensors of an IMU that sits elsewhere in the axes of the body of the poses, whose camera they are told of.
void turn_into_body(NavigationLog& log, const Pose& T_body_imu, WrittenFlight& written) {
  for (ImuSample& sample : log.imu) {
    sample.angular_rate = T_body_imu.rotation * sample.angular_rate;
    sample.specific_force = T_body_imu.rotation * sample.specific_force;
  }
  for (MagneticField& sample : log.magnetometer) sample.field = T_body_imu.rotation * sample.field;
  if (log.gnss.lever_arm) log.gnss.lever_arm = T_body_imu * *log.gnss.lever_arm;
  const Eigen::Vector3d& place = T_body_imu.translation;
  written.notes.emplace_back("the IMU's samples are turned into the axes of the body of the poses");
  if (place.norm() > 0)
    written.left_out.push_back(
        fmt::format("the place of the IMU, {:.3f} {:.3f} {:.3f} m from the body of the poses", place.x(),
                    place.y(), place.z()));
}

/// The sensors as the project's own tables.
Status write_tables(const NavigationLog& log, const OutputFolder& folder) {
  if (!log.imu.empty()) {
    if (Status status = folder.write("imu.csv", format_imu(log.imu)); !status) return status;
  }
  if (!log.gnss.fixes.empty() || !log.gnss.velocities.empty()) {
    if (Status status = folder.write("gnss.csv", format_gnss(log.gnss)); !status) return status;
  }
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

/// Of what a flight may have, what is there by now, each behind a blank.
Result<std::string> files_written(const OutputFolder& folder) {
  std::string files;
  for (const char* const name :
       {"rgb", "groundtruth.txt", "mask.png", "imu.csv", "gnss.csv", "mag.csv", "baro.csv"}) {
    const auto place = folder.place(name);
    if (!place) return place.error();
    if (path_exists(*place)) files += fmt::format(" {}", name);
  }
  return files;
}

/// mask.png as it is, or of a mask that a recording states.
Status write_mask(const Sequence& sequence, const OutputFolder& folder, WrittenFlight& written) {
  if (!sequence.mask_is_stated()) return {};
  if (const auto file = sequence.folder() / "mask.png"; path_exists(file)) {
    const auto bytes = read_file(file);
    return bytes ? folder.write("mask.png", *bytes) : Status(bytes.error());
  }
  if (sequence.raw_camera().distortion != Distortion::none) {
    written.left_out.emplace_back("the mask, which is of the undistorted images");
    return {};
  }
  const auto bytes = encode_png(sequence.mask());
  if (bytes.empty()) return Error{"mask.png: cannot be written as PNG"};
  return folder.write("mask.png", std::span<const unsigned char>(bytes));
}

bool has_correlations(const GnssLog& gnss) {
  return std::any_of(gnss.fixes.begin(), gnss.fixes.end(),
                     [](const GnssFix& fix) { return !fix.covariance.isDiagonal(); });
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
  written.notes = changed(sequence, log);
  if (has_motions(sequence))
    written.left_out.emplace_back("the covariances of the motions between the frames");
  if (Status status = write_mask(sequence, folder, written); !status) return status.error();
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
  if (Status status = folder.write("groundtruth.txt", format_trajectory(rows)); !status)
    return status.error();
  if (log != nullptr) {
    written.imu = log->imu.size();
    written.fixes = log->gnss.fixes.size();
    NavigationLog sensors = on_clock_of_images(*log, clock_offset(sequence));
    if (has_correlations(sensors.gnss))
      written.left_out.emplace_back("the correlations of the GNSS positions");
    if (const auto T_body_imu = imu_on_body(sequence)) turn_into_body(sensors, *T_body_imu, written);
    if (Status status = write_tables(sensors, folder); !status) return status.error();
  }
  const auto files = files_written(folder);
  if (!files) return files.error();
  const std::string calibration = camera_yaml(sequence, *files + " camera.yaml");
  if (Status status = folder.write("camera.yaml", calibration); !status) return status.error();
  return written;
}

}  // namespace pade::io
