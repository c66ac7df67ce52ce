#include "pade/simulation/generator/paper_set.hpp"

#include <cmath>
#include <numbers>

namespace pade::simulation {
namespace {

using Eigen::Vector3d;

constexpr double kDegree = std::numbers::pi / 180;
constexpr double kFrameRate = 10;
constexpr double kSpeed = 2;
constexpr double kLead = 2;  // s of flight before the first frame

/// A straight flight of `frames` frames that has its first frame at `start`.
std::vector<Waypoint> straight(const Vector3d& start, const Vector3d& direction, int frames, double speed,
                               double yaw_at_start, double yaw_rate) {
  const Vector3d velocity = speed * direction.normalized();
  const double duration = (frames - 1) / kFrameRate;
  std::vector<Waypoint> points;
  constexpr int kPoints = 6;
  for (int i = 0; i < kPoints; ++i) {
    const double t = -kLead + (kLead + duration + 0.05) * i / (kPoints - 1);
    points.push_back({start + t * velocity, yaw_at_start + t * yaw_rate, kLead + t});
  }
  return points;
}

/// Left and right around trunks that stand every seven metres on the x axis.
std::vector<Waypoint> around_the_trunks() {
  std::vector<Waypoint> points;
  constexpr double kBeside = 0.75;
  for (int i = -1; i < 6; ++i) {
    const double side = i % 2 == 0 ? 1 : -1;
    points.push_back({{7.0 * i, kBeside * side, 1.7}, 0, {}});
  }
  return points;
}

/// About a vertical axis at `centre`, looking outward: 2 degrees and 2.8 cm per frame, `climb` m/s.
std::vector<Waypoint> pirouette(const Vector3d& centre, int frames, double yaw_at_start, double climb) {
  constexpr double kTurn = 20 * kDegree;  // per second
  constexpr double kRadius = 0.28 / kTurn;
  const double duration = (frames - 1) / kFrameRate;
  std::vector<Waypoint> points;
  constexpr int kPoints = 25;
  for (int i = 0; i < kPoints; ++i) {
    const double t = -kLead + (kLead + duration + 0.05) * i / (kPoints - 1);
    const double yaw = yaw_at_start + t * kTurn;
    points.push_back(
        {centre + Vector3d(kRadius * std::cos(yaw), kRadius * std::sin(yaw), climb * t), yaw, kLead + t});
  }
  return points;
}

PaperSequence sequence(std::string name, WorldKind world, int frames, std::vector<Waypoint> waypoints) {
  PaperSequence out{std::move(name), world, 0, {}};
  out.flight.name = out.name;
  out.flight.frames = frames;
  out.flight.frame_rate = kFrameRate;
  out.flight.first_frame = kLead;
  out.flight.waypoints = std::move(waypoints);
  out.flight.trajectory.speed = kSpeed;
  return out;
}

std::vector<PaperSequence> all_sequences() {
  constexpr int kLong = 104;   // eight of these
  constexpr int kShort = 103;  // and two of these are 1038
  const Vector3d east = Vector3d::UnitX();
  std::vector<PaperSequence> set;
  set.push_back(
      sequence("forward", WorldKind::street, kLong, straight({2, 0.4, 1.8}, east, kLong, kSpeed, 0, 0)));
  set.push_back(sequence("sideways", WorldKind::building, kLong,
                         straight({19.6, -11, 2.2}, Vector3d::UnitY(), kLong, kSpeed, 0, 0)));
  set.push_back(sequence("vertical", WorldKind::building, kLong,
                         straight({20.5, 20.2, 4.6}, Vector3d::UnitZ(), kLong, kSpeed, 0, 0)));

  // The attitude swings about one axis while the path stays straight: as a gust or a gimbal does it.
  auto yawing =
      sequence("forward-yaw", WorldKind::street, kLong, straight({26, -0.3, 2.1}, east, kLong, kSpeed, 0, 0));
  yawing.flight.trajectory.yaw = {16 * kDegree, 6, 0};
  set.push_back(std::move(yawing));
  auto pitching =
      sequence("forward-pitch", WorldKind::rubble, kLong, straight({0, 0, 2.1}, east, kLong, kSpeed, 0, 0));
  pitching.flight.trajectory.pitch = {8 * kDegree, 4.5, 0};
  set.push_back(std::move(pitching));
  auto rolling = sequence("forward-roll", WorldKind::corridor, kLong,
                          straight({-7, 0.4, 1.6}, east, kLong, kSpeed, 0, 0));
  rolling.flight.trajectory.roll = {15 * kDegree, 5, 0};
  set.push_back(std::move(rolling));
  auto diagonal = sequence("diagonal", WorldKind::building, kLong,
                           straight({4, 16.5, 1.6}, {0.68, -0.7, 0.16}, kLong, kSpeed, -0.35, 0.06));
  diagonal.flight.trajectory.roll = {6 * kDegree, 4, 1};
  diagonal.flight.trajectory.pitch = {4 * kDegree, 5, 0};
  set.push_back(std::move(diagonal));
  set.push_back(sequence("approach", WorldKind::building, kLong,
                         straight({1.2, 3, 2.4}, {1, -0.06, -0.015}, kLong, kSpeed, -0.05, 0)));

  auto slalom = sequence("slalom", WorldKind::forest, kShort, around_the_trunks());
  slalom.flight.trajectory.heading = Heading::path;
  set.push_back(std::move(slalom));
  set.push_back(sequence("rotation", WorldKind::rubble, kShort, pirouette({14, 0, 1.7}, kShort, -0.5, 0.01)));
  return set;
}

}  // namespace

std::vector<PaperSequence> paper_sequences(std::uint64_t seed, bool quick) {
  std::vector<PaperSequence> set = all_sequences();
  for (std::size_t i = 0; i < set.size(); ++i) {
    set[i].world_seed = seed * 100 + i;
    if (quick) {
      // A tenth of the frames, from the middle of the flight, one after the other: the motion from frame to
      // frame is the same.
      Flight& flight = set[i].flight;
      const int fewer = (flight.frames + 5) / 10;
      flight.first_frame += (flight.frames - fewer) / 2 / flight.frame_rate;
      flight.frames = fewer;
    }
  }
  return set;
}

}  // namespace pade::simulation
