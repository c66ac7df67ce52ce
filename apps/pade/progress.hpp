// One line on a terminal that tells how far a long job is. In a pipe it is a line every 25 s.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdio>
#include <string>
#include <utility>

#include <fmt/format.h>
#include <unistd.h>

namespace pade::cli {

/// "Rendering  12 of 40  5.1 per second", rewritten in place on standard error at most ten times a second.
class Progress {
 public:
  /// `total`: 0 where nobody knows.
  Progress(std::string what, std::size_t total)
      : what_(std::move(what)), total_(total), visible_(isatty(STDERR_FILENO) != 0) {}
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;
  ~Progress() {
    if (shown_) fmt::print(stderr, "\r\033[K");
  }

  /// One more of the total is done. `note` is appended as it is.
  void step(const std::string& note = {}) { show(done_ + 1, note); }
  /// So many are done.
  void show(std::size_t done, const std::string& note) {
    done_ = done;
    const auto now = Clock::now();
    if (!visible_) {
      if (now - last_ < std::chrono::seconds(25)) return;
      last_ = now;
      fmt::print(stderr, "{}  {}{}  {}\n", what_, done_, of_total(), note);
      return;
    }
    if ((done_ < total_ || total_ == 0) && shown_ && now - last_ < std::chrono::milliseconds(100)) return;
    last_ = now;
    shown_ = true;
    const double seconds = std::chrono::duration<double>(now - start_).count();
    fmt::print(stderr, "\r\033[K{}  {}{}  {:.1f} per second  {}", what_, done_, of_total(),
               static_cast<double>(done_) / seconds, note);
    std::fflush(stderr);
  }

 private:
  using Clock = std::chrono::steady_clock;
  [[nodiscard]] std::string of_total() const { return total_ > 0 ? fmt::format(" of {}", total_) : ""; }

  std::string what_;
  std::size_t total_;
  std::size_t done_ = 0;
  bool visible_;
  bool shown_ = false;
  Clock::time_point start_ = Clock::now();
  Clock::time_point last_ = start_;
};

}  // namespace pade::cli
