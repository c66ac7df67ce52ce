// `pade live`: camera and autopilot in, sectors and a map out.
#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "pade/io/atomic_output.hpp"
#include "pade/live/camera/folder_source.hpp"
#include "pade/live/config.hpp"
#include "pade/live/dds/dds_sink.hpp"
#include "pade/live/link/filtered_poses.hpp"
#include "pade/live/map_saver.hpp"
#include "pade/live/recordings/session_recorder.hpp"
#include "pade/live/service.hpp"
#include "pade/live/session.hpp"
#include "pade/live/web/publisher.hpp"
#include "pade/live/web/web_server.hpp"

#include "commands.hpp"
#include "live/live_log.hpp"

namespace pade::cli {
namespace {

struct LiveArguments {
  std::string config;
  double seconds = 0;
  bool check = false;
  bool web = false;
};

/// Talks with the autopilot in a thread of its own, as long as it lives.
class LinkThread {
 public:
  LinkThread(live::AutopilotLink& link, const live::Progress& progress)
      : thread_([this, &link, &progress] {
          constexpr int kRound = 5;  // ms
          while (!over_) {
            link.wait(kRound);
            const Time now = live::now_of_ours();
            link.step(now, progress);
            turned_ = now.nanoseconds;
          }
        }) {}
  LinkThread(const LinkThread&) = delete;
  LinkThread& operator=(const LinkThread&) = delete;
  ~LinkThread() {
    over_ = true;
    thread_.join();
  }
  /// When it last went round.
  [[nodiscard]] Time turned() const { return Time{turned_}; }

 private:
  std::atomic<bool> over_{false};
  std::atomic<std::int64_t> turned_{0};
  std::thread thread_;
};

/// Everything that a session is made of.
struct LiveParts {
  live::LiveOptions options;
  std::unique_ptr<live::DdsParts> dds;  // first: the others use it
  live::OpenCamera camera;
  std::unique_ptr<live::AutopilotLink> link;
};

Result<LiveParts> open_parts(const LiveArguments& arguments) {
  auto options = live::read_live_options(arguments.config);
  if (!options) return options.error();
  if (const Status place = live::check_place("map", options->map); !place) return place.error();
  if (const Status place = live::check_place("record", options->record); !place) return place.error();
  std::unique_ptr<live::DdsParts> dds;
  if (options->needs_dds()) {
    auto joined = live::join_dds(options->dds);
    if (!joined) return joined.error();
    dds = std::move(*joined);
    say(fmt::format("dds: domain {}{}\n", dds->network->domain(),
                    live::is_local(options->dds) ? ", this machine alone" : ""));
  }
  auto camera = live::open_camera(*options, dds.get());
  if (!camera) return camera.error();
  auto link = live::open_link(*options, camera->T_body_camera, dds.get());
  if (!link) return link.error();
  return LiveParts{std::move(*options), std::move(dds), std::move(*camera), std::move(*link)};
}

/// What a link carries each second against what it can, for who has to choose its speed.
std::string link_load(const live::LiveOptions& options) {
  constexpr double kSectors = 179, kAttitude = 44, kPosition = 40, kOdometry = 245, kClock = 30;  // bytes
  constexpr double kImu = 100 * 75, kFix = 5 * 64;  // bytes per second of HIGHRES_IMU and GPS_RAW_INT
  constexpr double kPoints = 2 * 10 * 40;           // of ten faces, twice
  double poses = options.link.pose_rate * (kAttitude + kPosition);
  if (options.link.poses == live::PoseMessages::odometry) poses = options.link.pose_rate * kOdometry;
  if (options.link.poses == live::PoseMessages::sensors) poses = kImu + kFix;
  const bool faces = options.link.obstacles == live::ObstacleMessages::faces;
  const double out = options.camera.rate * (faces ? kPoints : kSectors) + 10 * kClock;
  const double in = poses + 10 * kClock;
  if (!options.link.port.starts_with("/")) {
    return fmt::format("{:.1f} kB/s in, {:.1f} kB/s out", 1e-3 * in, 1e-3 * out);
  }
  const double bytes = options.link.baud / 10.0;  // start and stop bits
  return fmt::format("{:.0f} % in, {:.0f} % out of {} baud, without what else it carries", 100 * in / bytes,
                     100 * out / bytes, options.link.baud);
}

bool report(const char* what, bool good, const std::string& text) {
  fmt::print("  {:<10} {:<8} {}\n", what, good ? "found" : "MISSING", text);
  return good;
}

/// Opens everything and waits a while for what should come.
Status check_parts(LiveParts& parts) {
  live::Progress progress;
  live::LiveFrame frame;
  bool image = false;
  live::LinkReport link;
  const bool alone = parts.options.link.port == live::no_port;
  {
    const LinkThread thread(*parts.link, progress);
    const Time start = live::now_of_ours();
    constexpr double kPatience = 6;  // s
    while (seconds_between(start, live::now_of_ours()) < kPatience && !io::interrupted()) {
      constexpr int kRound = 50;  // ms
      image = parts.camera.source->next(frame, kRound) == live::FrameSource::Outcome::frame || image;
      link = parts.link->report();
      if (image && (link.synchronised || alone) && link.poses_come) break;
    }
  }
  const Camera& camera = parts.camera.source->camera();
  const std::string remark = image ? std::string() : parts.camera.source->remark();
  bool good =
      report("camera", image, remark.empty() ? fmt::format("{} x {}", camera.width, camera.height) : remark);
  report("mounting", parts.camera.mounting_stated,
         parts.camera.mounting_stated ? "from the calibration"
                                      : "taken as looking ahead from the body's origin");
  if (alone) {
    fmt::print("  {:<10} {:<8} {}\n", "autopilot", "none", "link.port: none: nobody gets sectors or texts");
  } else {
    good = report("autopilot", link.autopilot.has_value(),
                  link.autopilot ? live::name_of(*link.autopilot)
                                 : "no HEARTBEAT at " + parts.options.link.port) &&
           good;
    good = report("clock", link.synchronised,
                  link.synchronised ? fmt::format("errs by at most {:.1f} ms", 1e3 * link.clock_bound)
                                    : "no answer to TIMESYNC") &&
           good;
  }
  good =
      // Before take-off our own filter has all that it needs but for the heading.
      report("poses", link.poses_come || link.poses_missing == live::heading_unknown,
             link.refused.empty() || link.poses_come
                 ? link.poses_missing.empty() ? link.poses_summary
                                              : fmt::format("{} ({})", link.poses_missing, link.poses_summary)
                 : fmt::format("the autopilot refused {}", link.refused)) &&
      good;
  if (!alone) fmt::print("  {:<10} {:<8} {}\n", "link load", "", link_load(parts.options));
  return good ? Status() : Status(Error{"something is missing (see above)"});
}

/// What shows how a session is asks this.
live::HealthQuestion health_question(const LiveParts& parts, const live::Progress& progress,
                                     const live::SharedText& stamps) {
  return [&link = *parts.link, &progress, &stamps] {
    live::HealthInputs inputs;
    inputs.now = live::now_of_ours();
    inputs.image = progress.image;
    inputs.depth = progress.depth;
    inputs.link = link.report();
    inputs.missing = live::text_of(inputs.link);
    constexpr double kLongest = 0.4;  // s
    const bool no_image = inputs.image == 0 || seconds_between({inputs.image}, inputs.now) > kLongest;
    if (inputs.link.missing == live::Missing::autopilot && no_image)
      inputs.missing = live::text_of(live::Missing::camera);
    inputs.stamps = stamps.get();
    return inputs;
  };
}

/// The page and Foxglove, where they are asked for.
class Web {
 public:
  static Result<std::unique_ptr<Web>> open(const LiveParts& parts, const live::HealthQuestion& question) {
    const live::LiveOptions& options = parts.options;
    auto web = std::make_unique<Web>();
    web->publisher_.emplace(parts.camera.source->camera(), parts.camera.T_body_camera, options.sectors,
                            question);
    auto server = live::WebServer::start(options.web, *web->publisher_);
    if (!server) return server.error();
    web->server_ = std::move(*server);
    say(fmt::format("page: {}{}; Foxglove: the same with ws://\n", web->server_->url(),
                    options.web.token.empty() ? "" : "?token=... (web.token)"));
    return web;
  }
  [[nodiscard]] live::Publisher& publisher() { return *publisher_; }
  /// For the log.
  [[nodiscard]] std::string text() const {
    const live::WebCounts counts = server_->counts();
    std::string text =
        fmt::format("web: {} clients now, {} so far; {} messages dropped for newer ones, {} requests refused",
                    counts.clients, counts.come, counts.dropped, counts.refused);
    if (!counts.last_refusal.empty()) text += fmt::format(" (last: {})", counts.last_refusal);
    return text;
  }

 private:
  std::optional<live::Publisher> publisher_;
  std::unique_ptr<live::WebServer> server_;  // last: it uses the others
};

/// What the session shows to others, and what they say.
struct LiveViews {
  std::unique_ptr<Web> web;
  std::unique_ptr<live::DdsSink> topics;

  /// Now and then; the mapper's thread.
  void maybe(const live::SessionCounts& counts) {
    constexpr double kPause = 0.2;  // s
    const Time now = live::now_of_ours();
    if (seconds_between(last, now) < kPause) return;
    last = now;
    if (web) web->publisher().take_counts(counts);
    if (topics) topics->take_counts(counts);
  }
  /// For the log.
  [[nodiscard]] std::vector<std::string> texts(const live::Progress& progress,
                                               const live::DdsParts* dds) const {
    std::vector<std::string> texts;
    if (web) texts.push_back(web->text());
    if (topics) texts.push_back(fmt::format("dds: {}", topics->text()));
    std::string why = progress.no_image.get();
    if (why.empty() && dds != nullptr) why = dds->shared.no_image.get();
    if (!why.empty()) texts.push_back(fmt::format("camera: {}", why));
    return texts;
  }
  Time last{};
};

Result<LiveViews> open_views(const LiveArguments& arguments, const LiveParts& parts,
                             const live::HealthQuestion& question) {
  LiveViews views;
  if (arguments.web) {
    auto opened = Web::open(parts, question);
    if (!opened) return opened.error();
    views.web = std::move(*opened);
  }
  const live::LiveOptions& options = parts.options;
  if (!options.dds.publish) return views;
  live::DdsSinkParts about{parts.camera.source->camera(), parts.camera.T_body_camera, options.sectors};
  about.states_body = options.link.poses != live::PoseMessages::dds;
  about.states_camera = options.camera.kind != live::CameraKind::dds;
  auto topics = live::DdsSink::start(*parts.dds->network, parts.dds->shared, options.dds, about, question);
  if (!topics) return topics.error();
  views.topics = std::move(*topics);
  return views;
}

/// Tells systemd that all threads get on, each second. Called by the mapper's thread, so that one that is
/// stuck says nothing.
class Pulse {
 public:
  Pulse(const live::ServiceManager& service, const LinkThread& link) : service_(service), link_(link) {}
  void maybe(const live::AutopilotLink& link) {
    constexpr double kPause = 1, kStuck = 2;  // s
    const Time now = live::now_of_ours();
    if (!service_.listens() || seconds_between(last_, now) < kPause) return;
    last_ = now;
    if (seconds_between(link_.turned(), now) < kStuck) service_.alive(live::text_of(link.report().missing));
  }

 private:
  const live::ServiceManager& service_;
  const LinkThread& link_;
  Time last_;
};

/// @param text  gets what is to be said of it
Status save_map(const live::Session& session, live::MapSaver& saver, const std::string& file,
                std::string& text) {
  const live::SaverReport meanwhile = saver.finish();
  for (const std::string& finished : meanwhile.finished)
    text += fmt::format("{}: until a map was begun anew\n", finished);
  if (meanwhile.failed > 0) {
    say(fmt::format("{} times the map could not be saved meanwhile: {}\n", meanwhile.failed,
                    meanwhile.error));
  }
  const live::SessionCounts& counts = session.counts();
  if (counts.mapped > 0 && counts.restarts > 0 && !meanwhile.any) {
    text += fmt::format("nothing was mapped since the map was begun anew, so {} is not written\n", file);
  } else if (meanwhile.any) {
    if (Status saved = saver.write_last(session.map()); !saved) return saved;
    const std::string earlier = saver.report().earlier;
    if (!earlier.empty()) text += fmt::format("{}: of an earlier session\n", earlier);
    const mapping::OccupancyMap::Counts voxels = session.map().counts();
    text += fmt::format("{}: {} voxels occupied, {} free\n", file, voxels.occupied, voxels.free);
    if (!session.origin().isZero()) text += origin_text(session) + "\n";
  }
  if (!meanwhile.any && counts.restarts == 0)
    return Error{fmt::format("nothing was mapped, so {} is not written", file)};
  return {};
}

/// Where the recording is, or why there is none.
std::string recorded(live::SessionRecorder& recorder) {
  const Status finished = recorder.finish();
  const live::RecorderReport report = recorder.report();
  if (!finished)
    return fmt::format("{}{}\n", finished.error().message,
                       report.left_out > 0 ? fmt::format(" ({} frames are missing)", report.left_out) : "");
  std::string text = fmt::format("{}: the frames of the map", report.file.string());
  if (report.left_out > 0)
    text += fmt::format(", without {} ({})", report.left_out,
                        report.ended.empty() ? "the disk was too slow" : report.ended);
  return text + "\n";
}

Status run_live(const LiveArguments& arguments) {
  io::watch_for_interrupts();
  (void)std::signal(SIGHUP, SIG_IGN);  // a terminal out of radio range must not end the flight's map
  if (!arguments.check) (void)std::signal(SIGPIPE, SIG_IGN);  // nor must whoever read its log
  auto parts = open_parts(arguments);
  if (!parts) return parts.error();
  const live::LiveOptions& options = parts->options;
  live::Progress progress;
  live::SharedText stamps_said;
  auto views = open_views(arguments, *parts, health_question(*parts, progress, stamps_said));
  if (!views) return views.error();
  if (arguments.check) return check_parts(*parts);
  const auto sight = live::SectorView::of(parts->camera.source->camera(), parts->camera.T_body_camera);
  live::SectorSink sectors(*parts->link, options.sectors, options.session.least_depth, sight);
  sectors.time_offset = options.session.time_offset;
  if (options.link.obstacles == live::ObstacleMessages::faces)
    sectors.see_points(parts->camera.source->camera(), parts->camera.T_body_camera);
  std::vector<live::Sink*> sinks{&sectors};
  std::optional<live::MapSaver> saver;
  if (!options.map.empty())
    sinks.push_back(&saver.emplace(options.map, options.autosave, options.mapper.map));
  if (views->web) sinks.push_back(&views->web->publisher());
  if (views->topics) sinks.push_back(views->topics.get());
  sectors.listener = [&shown = *views](const auto& distances, Time frame) {
    if (shown.web) shown.web->publisher().take_sectors(distances, frame);
    if (shown.topics) shown.topics->take_sectors(distances, frame);
  };
  std::unique_ptr<live::SessionRecorder> recorder;
  if (!options.record.empty()) {
    const live::FrameSource& camera = *parts->camera.source;
    auto made = live::SessionRecorder::create(options.record, camera.camera(), camera.mask());
    if (!made) return made.error();
    recorder = std::move(*made);
    for (const std::string& earlier : recorder->report().earlier)
      say(fmt::format("{}: recorded by an earlier session\n", earlier));
  }
  auto session = live::Session::create(
      {*parts->camera.source, *parts->link, sinks, progress, parts->camera.T_body_camera, recorder.get()},
      options.session, options.mapper);
  if (!session) return session.error();
  const live::ServiceManager service;
  {
    const LinkThread thread(*parts->link, progress);
    LiveLog log;
    Pulse pulse(service, thread);
    FileTroubles troubles(saver ? &*saver : nullptr, recorder.get());
    service.ready();
    const Time start = live::now_of_ours();
    session->run([&] {
      const std::string stamps = live::stamp_text(session->stamp_offset());
      log.maybe(progress, parts->link->report(), *session,
                [&] { return views->texts(progress, parts->dds.get()); });
      stamps_said.set(stamps);
      views->maybe(session->counts());
      pulse.maybe(*parts->link);
      troubles.maybe(*parts->link);
      const bool over =
          arguments.seconds > 0 && seconds_between(start, live::now_of_ours()) > arguments.seconds;
      return over || io::interrupted();
    });
  }
  service.stopping();
  parts->link->end();
  std::string text;
  const Status saved = saver ? save_map(*session, *saver, options.map, text) : Status();
  text += summary(session->counts(), parts->link->report());
  if (const std::string stamps = live::stamp_text(session->stamp_offset()); !stamps.empty())
    text += stamps + "\n";
  for (const std::string& view : views->texts(progress, parts->dds.get())) text += view + "\n";
  if (recorder != nullptr) text += recorded(*recorder);
  (void)std::fputs(text.c_str(), stdout);
  return saved;
}

}  // namespace

void add_live(CLI::App& app, Context& context) {
  auto arguments = std::make_shared<LiveArguments>();
  CLI::App* command =
      app.add_subcommand("live", "Map beside an autopilot: camera and MAVLink in, OBSTACLE_DISTANCE out");
  command->footer(
      "Runs until SIGTERM or Ctrl-C, saves the map meanwhile and at the end. docs/live.md has the wiring, "
      "the autopilots' parameters and the file.\n"
      "A file to begin with is config/live/vehicle.yaml. Not there yet: signing of packets, "
      "ONBOARD_COMPUTER_STATUS.");
  command
      ->add_option("CONFIG", arguments->config, "YAML: camera, link, session, sectors, mapper, map, web, dds")
      ->required();
  command->add_flag("--web", arguments->web,
                    "Show the session on a page and to Foxglove (section web of CONFIG)");
  command->add_flag("--check", arguments->check, "Open everything, say what is missing, and end");
  command->add_option("--for", arguments->seconds, "End after so many seconds")->check(CLI::Range(0.0, 1e6));
  command->callback([arguments, &context] {
    const Status status = run_live(*arguments);
    if (status) return;
    say(fmt::format("pade live: {}\n", status.error().message));
    context.exit_code = 1;
  });
}

}  // namespace pade::cli
