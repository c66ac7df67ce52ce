#include "live/live_log.hpp"

#include <atomic>
#include <cstdio>
#include <utility>

#include <fmt/format.h>
#include <poll.h>
#include <unistd.h>

namespace pade::cli {
namespace {

std::string outside_text(const live::SessionCounts& counts) {
  return fmt::format("{} points lay beyond what a map can hold (mapper.map.voxel)", counts.outside);
}

}  // namespace

void say(const std::string& text) {
  static std::atomic<std::size_t> left_out{0};
  pollfd log{STDERR_FILENO, POLLOUT, 0};
  if (::poll(&log, 1, 0) != 1 || (log.revents & POLLOUT) == 0) {
    ++left_out;
    return;
  }
  if (const std::size_t lines = left_out.exchange(0); lines > 0)
    (void)std::fputs(fmt::format("({} lines were left out: nobody read them)\n", lines).c_str(), stderr);
  (void)std::fputs(text.c_str(), stderr);
}

std::string origin_text(const live::Session& session) {
  const Eigen::Vector3d& origin = session.origin();
  return fmt::format("the map's 0 0 0 is {:.2f} m east, {:.2f} m north, {:.2f} m up of that of the poses",
                     origin.x(), origin.y(), origin.z());
}

void LiveLog::maybe(const live::Progress& progress, const live::LinkReport& link,
                    const live::Session& session, const std::function<std::vector<std::string>()>& others) {
  constexpr double kPause = 5;  // s
  const Time now = live::now_of_ours();
  const live::SessionCounts& counts = session.counts();
  if (std::exchange(restarts_, counts.restarts) != counts.restarts) {
    const bool border = std::exchange(borders_, counts.borders) != counts.borders;
    say(fmt::format(
        "the map is begun anew, since {}\n",
        border ? "the vehicle has come near the border of what a map can hold" : "the poses have jumped"));
  }
  if (std::exchange(origin_, session.origin()) != session.origin()) say(origin_text(session) + "\n");
  if (seconds_between(last_, now) < kPause) return;
  last_ = now;
  const std::string stamps = live::stamp_text(session.stamp_offset());
  const auto age = [&](std::int64_t then) {
    return then == 0 ? std::string("none")
                     : fmt::format("{:.2f} s old", 1e-9 * static_cast<double>(now.nanoseconds - then));
  };
  say(fmt::format("{}; image {}, depth {}; {} sectors sent, {} packets in, {} bad, {} gaps\n",
                  live::text_of(link), age(progress.image), age(progress.depth), link.sectors_sent,
                  link.in.packets, link.in.bad, link.in.gaps));
  if (link.level_instead)
    say("the autopilot does not know OBSTACLE_DISTANCE_3D: it gets OBSTACLE_DISTANCE (link.obstacles: "
        "level)\n");
  if (!stamps.empty()) say(stamps + "\n");
  if (counts.outside > 0) say(outside_text(counts) + "\n");
  for (const std::string& text : others()) say(text + "\n");
}

void FileTroubles::maybe(live::AutopilotLink& link) {
  constexpr double kPause = 1;  // s
  const Time now = live::now_of_ours();
  if (seconds_between(last_, now) < kPause) return;
  last_ = now;
  if (saver_ != nullptr) {
    const live::SaverReport report = saver_->report();
    if (std::exchange(failed_, report.failed) != report.failed) {
      say(fmt::format("the map cannot be saved: {}\n", report.error));
      link.warn("the map cannot be saved");
    }
  }
  if (recorder_ != nullptr) {
    const live::RecorderReport report = recorder_->report();
    if (!report.ended.empty() && std::exchange(ended_, report.ended) != report.ended) {
      say(fmt::format("nothing more is recorded: {}\n", report.ended));
      link.warn("nothing more is recorded");
    }
    if (std::exchange(any_left_out_, report.left_out > 0) != (report.left_out > 0) && report.ended.empty())
      say("the disk is too slow for the recording: frames are left out, it will not make the same map\n");
  }
}

std::string summary(const live::SessionCounts& counts, const live::LinkReport& link) {
  std::string text = fmt::format(
      "{} frames: {} mapped, {} skipped, {} dropped for newer ones; {} sectors sent, {} too old to be sent\n",
      counts.frames, counts.mapped, counts.skipped, counts.dropped, link.sectors_sent, link.sectors_stale);
  if (link.sectors_empty > 0)
    text += fmt::format("  {} sectors that say nothing, so that the autopilot can be armed at rest\n",
                        link.sectors_empty);
  for (const auto& [reason, count] : counts.reasons) text += fmt::format("  skipped {}: {}\n", count, reason);
  if (const std::size_t jumps = counts.restarts - counts.borders; jumps > 0)
    text += fmt::format("  {} maps begun anew because the poses jumped\n", jumps);
  if (counts.borders > 0)
    text +=
        fmt::format("  {} maps begun anew because the vehicle came near the border of what one can hold\n",
                    counts.borders);
  if (counts.outside > 0) text += fmt::format("  {}\n", outside_text(counts));
  text += fmt::format("link: {} packets, {} bad, {} gaps; {} packets of ours not taken\n", link.in.packets,
                      link.in.bad, link.in.gaps, link.unsent);
  return text;
}

}  // namespace pade::cli
