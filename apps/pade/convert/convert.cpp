// `pade convert`: a flight from a folder or a recording into a rosbag, an MCAP file or a folder.
#include <algorithm>
#include <array>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>
#include <vector>

#include <fmt/format.h>

#include "pade/io/atomic_output.hpp"
#include "pade/io/navigation/navigation_log.hpp"
#include "pade/io/recording/flight/flight_writer.hpp"
#include "pade/io/recording/recording.hpp"
#include "pade/io/text.hpp"
#include "pade/offline/map_sequence.hpp"

#include "commands.hpp"
#include "convert/convert_video.hpp"
#include "convert/flight_folder.hpp"
#include "progress.hpp"

namespace pade::cli {
namespace {

namespace fs = std::filesystem;

struct ConvertArguments {
  std::string in, out;
  std::string poses = "groundtruth", calibration, topics;
  int camera = 0;
  std::string start;
  bool force = false;
};

/// Refuses to write where the flight itself is: it would be gone before what was made of it is looked at.
Status check_apart(const ConvertArguments& arguments) {
  const auto place = [](const std::string& name) {
    std::error_code failed;
    const fs::path path = fs::weakly_canonical(name, failed);
    return path.has_filename() ? path : path.parent_path();  // "flight/" is "flight"
  };
  const fs::path way = place(arguments.in).lexically_relative(place(arguments.out));
  if (way.empty() || *way.begin() == "..") return {};
  return Error{fmt::format("{}: found {} in it, expected another place than that of the flight that is read",
                           arguments.out, arguments.in)};
}

/// The sensors that lie beside the images; empty if there are none. What is there and cannot be read is said.
std::optional<io::RecordedSensors> sensors_of(const ConvertArguments& arguments,
                                              const io::Sequence& sequence) {
  const fs::path in = arguments.in;
  const bool recording = io::is_recording(in);
  if (!recording && !io::path_exists(in / "imu.csv") && !io::path_exists(in / "mav0" / "imu0")) {
    for (const char* const file : {"gnss.csv", "baro.csv", "mag.csv"})
      if (io::path_exists(in / file)) fmt::print("left out: {}, since there is no imu.csv beside it\n", file);
    return std::nullopt;
  }
  Result<io::RecordedSensors> sensors = io::RecordedSensors{};
  if (recording) {
    sensors = io::read_some_sensors(in, arguments.topics);
  } else if (auto log = io::read_navigation_log(in)) {
    sensors->log = std::move(*log);
  } else {
    sensors = log.error();
  }
  if (sensors) return std::move(*sensors);
  fmt::print(stderr, "without the sensors of {}: {}\n", sequence.folder().string(), sensors.error().message);
  return std::nullopt;
}

/// Topics of a recording that nobody read.
std::string topics_left_out(const ConvertArguments& arguments, const io::Sequence& sequence,
                            const std::vector<std::string>& of_sensors) {
  if (!io::is_recording(arguments.in)) return {};
  const auto recording = io::Recording::open(arguments.in);
  if (!recording) return {};
  const auto is_among = [](const std::vector<std::string>& names, const std::string& name) {
    return std::find(names.begin(), names.end(), name) != names.end();
  };
  std::string text;
  for (const io::Topic& topic : recording->topics()) {
    const bool transforms = topic.type == "tf2_msgs/TFMessage" || topic.type == "tf/tfMessage";
    if (transforms || topic.messages.empty() || is_among(sequence.sources(), topic.name) ||
        is_among(of_sensors, topic.name))
      continue;
    text +=
        fmt::format("{}{} ({}, {})", text.empty() ? "" : ", ", topic.name, topic.type, topic.messages.size());
  }
  return text;
}

Result<io::WrittenFlight> write(const ConvertArguments& arguments, const io::Sequence& sequence,
                                const NavigationLog* log) {
  Progress progress("Converting", sequence.size());
  const auto step = [&](std::size_t done) {
    progress.show(done, "");
    return !io::interrupted();
  };
  const auto overwrite = arguments.force ? io::Overwrite::replace : io::Overwrite::refuse;
  if (fs::path(arguments.out).has_extension()) {
    auto writer = io::create_recording(arguments.out, overwrite);
    if (!writer) return writer.error();
    return io::write_flight(sequence, log, **writer, step);
  }
  if (arguments.force) {
    if (Status own = check_own_flight(arguments.out); !own) return own.error();
  }
  auto folder = io::OutputFolder::create(arguments.out, overwrite, kFlightMarker);
  if (!folder) return folder.error();
  auto written = io::write_flight(sequence, log, *folder, step);
  if (!written) return written;
  if (Status status = folder->commit(); !status) return status.error();
  return written;
}

/// Of a video; options that mean nothing there are refused.
Status convert_frames(const ConvertArguments& arguments) {
  const ConvertArguments defaults;
  const auto refused = [&](std::string_view option, bool given) -> Status {
    if (!given) return {};
    return Error{fmt::format("{}: found it for the video {}, which has none, expected a flight", option,
                             arguments.in)};
  };
  if (Status s = refused("--poses", arguments.poses != defaults.poses); !s) return s;
  if (Status s = refused("--topics", !arguments.topics.empty()); !s) return s;
  VideoConversion video{arguments.in, arguments.out,  arguments.calibration, arguments.camera,
                        {},           arguments.force};
  if (!arguments.start.empty()) {
    const auto start = parse_time(arguments.start);
    if (!start)
      return Error{fmt::format("--start: found \"{}\", expected a time in seconds", arguments.start)};
    video.start = *start;
  }
  return convert_video(video);
}

Status convert(const ConvertArguments& arguments) {
  if (Status apart = check_apart(arguments); !apart) return apart;
  if (is_video(arguments.in)) return convert_frames(arguments);
  if (!arguments.start.empty())
    return Error{
        fmt::format("--start: found it for {}, expected a video: a flight has its own times", arguments.in)};
  MapSequenceOptions options;
  options.sequence.poses = arguments.poses;
  options.sequence.calibration = arguments.calibration;
  options.sequence.topics = arguments.topics;
  options.sequence.camera = arguments.camera;
  options.sequence.origin = "none";
  const auto sequence = open_sequence(arguments.in, options);
  if (!sequence) return sequence.error();
  const auto sensors = sensors_of(arguments, *sequence);
  const auto written = write(arguments, *sequence, sensors ? &sensors->log : nullptr);
  if (!written) return written.error();
  for (const std::string& note : sequence->notes()) fmt::print("note: {}\n", note);
  if (sensors) {
    for (const std::string& remark : sensors->log.remarks) fmt::print("note: {}\n", remark);
  }
  for (const std::string& note : written->notes) fmt::print("note: {}\n", note);
  for (const std::string& what : written->left_out) fmt::print("left out: {}\n", what);
  const std::string topics =
      topics_left_out(arguments, *sequence, sensors ? sensors->topics : std::vector<std::string>{});
  if (!topics.empty()) fmt::print("left out: topics {}\n", topics);
  fmt::print("{} images, {} poses, {} IMU samples, {} GNSS positions in {}\n", written->images,
             written->poses, written->imu, written->fixes, arguments.out);
  return {};
}

}  // namespace

void add_convert(CLI::App& app, Context& context) {
  auto arguments = std::make_shared<ConvertArguments>();
  CLI::App* command = app.add_subcommand("convert", "A flight from one kind of recording into another.");
  command->footer(
      "Reads what `pade map` reads. Writes by the ending of OUT: .bag (rosbag 2.0), .mcap (MCAP with ROS 2 "
      "messages), "
      "none (a\nfolder in the TUM layout). Usable frames, calibration, mounting, mask, poses, IMU, GNSS, "
      "magnetometer and "
      "barometer are\ncarried over; what else there is, is left out and said (docs/formats.md).\n"
      "  pade convert flight flight.bag\n"
      "  pade convert flight.db3 flight\n"
      "  pade convert flight.mp4 --calibration camera.yaml flight   (images alone; docs/formats.md, "
      "\"Videos\")");
  command->add_option("IN", arguments->in, "Folder or recording of a flight")->required();
  command->add_option("OUT", arguments->out, "File or folder, made by this command")->required();
  command->add_option("--poses", arguments->poses, "groundtruth, original, from-imu-gnss or a pose file")
      ->capture_default_str();
  command->add_option("--calibration", arguments->calibration,
                      "Calibration file instead of the flight's own");
  command
      ->add_option("--camera", arguments->camera,
                   "Which camera of a calibration file that holds several, from 0")
      ->check(CLI::Range(0, 99));
  command->add_option("--topics", arguments->topics,
                      "Topics of a recording that are meant where several fit, separated by blanks");
  command->add_option("--start", arguments->start, "Of a video: time of its first frame, s (default 0)");
  command->add_flag("--force", arguments->force, "Replace a file, or a folder that this command wrote");
  command->callback([arguments, &context] {
    io::watch_for_interrupts();
    const Status status = convert(*arguments);
    if (status) return;
    fmt::print(stderr, "pade convert: {}\n", status.error().message);
    context.exit_code = io::interrupted() ? 130 : 1;
  });
}

}  // namespace pade::cli
