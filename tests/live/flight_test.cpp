// All of it together: a camera, an autopilot at the other end of a UDP line, and what it hears.
#include <atomic>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pade/live/link/autopilot_link.hpp"
#include "pade/live/session.hpp"

#include "live/udp_autopilot.hpp"
#include "live/wall_camera.hpp"

namespace pade::live {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;

constexpr int kFlightPort = 24'581;

TEST(Flight, TheAutopilotHearsOfTheWallAndOfACameraThatStalls) {
  WallCamera camera(10);
  auto port = open_udp(kFlightPort);
  ASSERT_TRUE(port) << port.error().message;
  AutopilotLink link(std::move(*port), {});
  Progress progress;
  SectorSink sectors(link, {}, 0.02);
  Pose mounting;
  mounting.rotation = Eigen::Quaterniond(forward_camera_rotation());
  ObstacleMapperOptions mapper;
  mapper.map.voxel = 0.25;
  SessionOptions options;
  options.velocity_sigma = 0.02;
  auto session = Session::create({camera, link, {&sectors}, progress, mounting}, options, mapper);
  ASSERT_TRUE(session) << session.error().message;
  UdpAutopilot autopilot(camera.zero, kFlightPort);
  std::atomic<bool> over{false};
  std::thread talk([&] {
    while (!over) {
      link.wait(5);
      link.step(now_of_ours(), progress);
    }
  });
  const Time start = now_of_ours();
  session->run([&] {
    const double elapsed = seconds_between(start, now_of_ours());
    camera.stalled = elapsed > 5;
    return elapsed > 7;
  });
  over = true;
  talk.join();

  const LinkReport report = link.report();
  EXPECT_TRUE(report.synchronised);
  EXPECT_EQ(report.in.bad, 0U);
  const auto heard = autopilot.sectors();
  ASSERT_GT(heard.size(), 5U);
  EXPECT_EQ(heard.size(), report.sectors_sent);
  EXPECT_NEAR(heard.back().sectors.distances[0], 285, 50);
  EXPECT_EQ(heard.back().sectors.distances[36], kUnknownDistance);
  // Nothing is sent of a frame that is older than 0.3 s: half a second leaves the line its time.
  EXPECT_LT(seconds_between({progress.image}, heard.back().time), 0.5);
  EXPECT_EQ(report.missing, Missing::camera);
  EXPECT_THAT(autopilot.texts(), Contains(HasSubstr("obstacle mapping active")));
  EXPECT_THAT(autopilot.texts().back(), HasSubstr("no image from the camera"));
  const SessionCounts& counts = session->counts();
  EXPECT_EQ(counts.frames, counts.mapped + counts.skipped + counts.dropped);
}

}  // namespace
}  // namespace pade::live
