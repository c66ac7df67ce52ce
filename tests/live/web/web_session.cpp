// A session with the server, from a recorded flight: for scripts/web-oracle and for measuring what clients
// cost. Not a test of its own.
#include <algorithm>
#include <array>
#include <atomic>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include <fmt/format.h>
#include <unistd.h>

#include "pade/live/link/autopilot_link.hpp"
#include "pade/live/session.hpp"
#include "pade/live/web/foxglove.hpp"
#include "pade/live/web/publisher.hpp"
#include "pade/live/web/web_server.hpp"

#include "live/udp_autopilot.hpp"
#include "live/web/raw_client.hpp"
#include "live/web/replay.hpp"

namespace pade::live {
volatile std::sig_atomic_t stall_asked = 0;
namespace {

constexpr int kLinkPort = 24'733;

/// How long frames take, from before the mapper to after the last sink, by what went on meanwhile.
class Stopwatch : public InputSink, public Sink {
 public:
  void take(const MapperInput& /*input*/) override { begun_ = now_of_ours(); }
  void begin_anew() override {}
  void take(const LiveUpdate& /*update*/) override {
    times[phase].push_back(1e3 * seconds_between(begun_, now_of_ours()));
  }
  std::string phase;
  std::map<std::string, std::vector<double>> times;  // ms

 private:
  Time begun_;
};

double resident_megabytes() {
  std::ifstream file("/proc/self/statm");
  double all = 0, resident = 0;
  file >> all >> resident;
  return resident * static_cast<double>(::sysconf(_SC_PAGESIZE)) / 1e6;
}

/// Wants everything and reads nothing, not even the answers.
std::unique_ptr<RawClient> frozen_client(int port) {
  auto client = std::make_unique<RawClient>(port);
  std::string list;
  for (std::size_t i = 1; i <= kWebChannels; ++i)
    list += fmt::format("{}{{\"id\":{},\"channelId\":{}}}", i == 1 ? "" : ",", i, i);
  client->ask({});
  client->send_text(fmt::format(R"({{"op":"subscribe","subscriptions":[{}]}})", list));
  return client;
}

struct Plan {
  double seconds = 20;
  int views = 4;     // of the mapper; 0: it is faster
  double phase = 0;  // s of each turn without and with frozen clients; 0: none
  int clients = 1;   // that are frozen
  double rate = 10;  // Hz
};

int run(const std::string& flight, int port, const Plan& plan) {
  const auto sequence = io::Sequence::open(flight);
  if (!sequence) return fmt::print(stderr, "{}\n", sequence.error().message), 1;
  ReplayedFlight camera(*sequence, plan.rate);
  Pose mounting;
  mounting.rotation = Eigen::Quaterniond(forward_camera_rotation());
  auto line = open_udp(kLinkPort);
  if (!line) return fmt::print(stderr, "{}\n", line.error().message), 1;
  AutopilotLink link(std::move(*line), {});
  Progress progress;
  const auto view = SectorView::of(camera.camera(), mounting);
  SectorSink sectors(link, {}, 0.02, view);
  Publisher publisher(camera.camera(), mounting, {}, [&] {
    HealthInputs inputs;
    inputs.now = now_of_ours();
    inputs.image = progress.image;
    inputs.depth = progress.depth;
    inputs.link = link.report();
    inputs.missing = text_of(inputs.link);
    return inputs;
  });
  sectors.listener = [&](const auto& distances, Time time) { publisher.take_sectors(distances, time); };
  WebOptions web;
  web.port = port;
  auto server = WebServer::start(web, publisher);
  if (!server) return fmt::print(stderr, "{}\n", server.error().message), 1;
  Stopwatch watch;
  ObstacleMapperOptions mapper;
  mapper.views.count = plan.views;
  auto session =
      Session::create({camera, link, {&sectors, &publisher, &watch}, progress, mounting, &watch}, {}, mapper);
  if (!session) return fmt::print(stderr, "{}\n", session.error().message), 1;
  const UdpAutopilot autopilot(camera.start(), kLinkPort, [&](Time time) {
    return camera_pose(camera.pose_at(time), mounting.inverse());
  });
  std::atomic<bool> over{false};
  std::thread talk([&] {
    while (!over) {
      link.wait(5);
      link.step(now_of_ours(), progress);
    }
  });
  fmt::print("{}\n", (*server)->url());
  (void)std::fflush(stdout);
  std::vector<std::unique_ptr<RawClient>> frozen;
  const Time start = now_of_ours();
  session->run([&] {
    const double elapsed = seconds_between(start, now_of_ours());
    camera.stalled = stall_asked != 0;
    publisher.take_counts(session->counts());
    if (plan.phase > 0) {
      const bool cold = static_cast<int>(elapsed / plan.phase) % 2 == 1;
      if (cold != !frozen.empty())
        fmt::print("{:.0f} s, clients {}: {:.1f} MB\n", elapsed, watch.phase, resident_megabytes());
      if (cold && frozen.empty())
        for (int i = 0; i < plan.clients; ++i) frozen.push_back(frozen_client((*server)->port()));
      if (!cold) frozen.clear();
      watch.phase = elapsed < 5 ? "start" : cold ? "frozen" : "none";
    }
    return elapsed > plan.seconds;
  });
  over = true;
  talk.join();
  const SessionCounts& counts = session->counts();
  fmt::print("{} frames, {} mapped, {} skipped, {} dropped; {} web messages dropped\n", counts.frames,
             counts.mapped, counts.skipped, counts.dropped, (*server)->counts().dropped);
  for (auto& [phase, times] : watch.times) {
    std::sort(times.begin(), times.end());
    fmt::print("clients {}: {} frames, frame time median {:.2f} ms, 95 % {:.2f} ms\n", phase, times.size(),
               times[times.size() / 2], times[times.size() * 95 / 100]);
  }
  return 0;
}

}  // namespace
}  // namespace pade::live

/// FLIGHT PORT [SECONDS [RATE [PHASE [CLIENTS [VIEWS]]]]]; SIGUSR1: the camera stands still, or goes on.
int main(int count, char** arguments) {
  if (count < 3) return 2;
  pade::live::Plan plan;
  const auto number = [&](int i, double otherwise) {
    return count > i ? std::atof(arguments[i]) : otherwise;
  };
  plan.seconds = number(3, plan.seconds);
  plan.rate = number(4, plan.rate);
  plan.phase = number(5, plan.phase);
  plan.clients = static_cast<int>(number(6, plan.clients));
  plan.views = static_cast<int>(number(7, plan.views));
  (void)std::signal(SIGUSR1, [](int) { pade::live::stall_asked = 1 - pade::live::stall_asked; });
  return pade::live::run(arguments[1], std::atoi(arguments[2]), plan);
}
