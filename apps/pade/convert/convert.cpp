// `pade convert`: a flight from a folder or a recording into a rosbag, an MCAP file or a folder.
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include <fmt/format.h>

#include "pade/io/atomic_output.hpp"
#include "pade/io/navigation/navigation_log.hpp"
#include "pade/io/recording/flight/flight_writer.hpp"
#include "pade/io/recording/recording.hpp"
#include "pade/io/text.hpp"
#include "pade/offline/map_sequence.hpp"

#include "commands.hpp"
#include "progress.hpp"

namespace pade::cli {
namespace {

namespace fs = std::filesystem;

struct ConvertArguments {
  std::string in, out;
  std::string poses = "groundtruth", calibration, topics;
  int camera = 0;
  bool force = false;
};

/// The sensors that lie beside the images; empty if there are none. What is there and cannot be read is said.
std::optional<NavigationLog> sensors_of(const ConvertArguments& arguments, const io::Sequence& sequence) {
  const fs::path in = arguments.in;
  const bool recording = io::is_recording(in);
  if (!recording && !io::path_exists(in / "imu.csv") && !io::path_exists(in / "mav0" / "imu0"))
    return std::nullopt;
  io::NavigationLogOptions options;
  options.topics = arguments.topics;
  auto log = io::read_navigation_log(in, options);
  if (log) return std::move(*log);
  const bool none = recording && log.error().message.find("is missing") != std::string::npos;
  if (!none)
    fmt::print(stderr, "without the sensors of {}: {}\n", sequence.folder().string(), log.error().message);
  return std::nullopt;
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
  auto folder = io::OutputFolder::create(arguments.out, overwrite, "camera.yaml");
  if (!folder) return folder.error();
  auto written = io::write_flight(sequence, log, *folder, step);
  if (!written) return written;
  if (Status status = folder->commit(); !status) return status.error();
  return written;
}

Status convert(const ConvertArguments& arguments) {
  MapSequenceOptions options;
  options.sequence.poses = arguments.poses;
  options.sequence.calibration = arguments.calibration;
  options.sequence.topics = arguments.topics;
  options.sequence.camera = arguments.camera;
  options.sequence.origin = "none";
  const auto sequence = open_sequence(arguments.in, options);
  if (!sequence) return sequence.error();
  const auto log = sensors_of(arguments, *sequence);
  const auto written = write(arguments, *sequence, log ? &*log : nullptr);
  if (!written) return written.error();
  for (const std::string& note : sequence->notes()) fmt::print("note: {}\n", note);
  for (const std::string& what : written->left_out) fmt::print("left out: {}\n", what);
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
      "none (a\nfolder in the TUM layout). Usable frames, calibration, mounting, poses, IMU, GNSS, "
      "magnetometer and "
      "barometer are\ncarried over; what else a recording holds is not (docs/formats.md).\n"
      "  pade convert flight flight.bag\n"
      "  pade convert flight.db3 flight");
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
  command->add_flag("--force", arguments->force, "Replace what is there");
  command->callback([arguments, &context] {
    io::watch_for_interrupts();
    const Status status = convert(*arguments);
    if (status) return;
    fmt::print(stderr, "pade convert: {}\n", status.error().message);
    context.exit_code = io::interrupted() ? 130 : 1;
  });
}

}  // namespace pade::cli
