#include "pade/live/map_saver.hpp"

#include <chrono>
#include <system_error>
#include <utility>

#include <fmt/format.h>

#include "pade/io/formats/map_files.hpp"
#include "pade/io/lasting_output.hpp"

namespace pade::live {

namespace fs = std::filesystem;

namespace {

io::MapFormat format_of(const fs::path& file) {
  return file.extension() == ".ot" ? io::MapFormat::ot : io::MapFormat::bt;
}

}  // namespace

Status write_lasting_map(const mapping::OccupancyMap& map, const fs::path& file) {
  return io::write_lasting_file(file, io::encode_map(map, format_of(file)));
}

MapSaver::MapSaver(fs::path file, double every)
    : file_(std::move(file)), every_(every), thread_([this] { work(); }) {}

MapSaver::~MapSaver() { finish(); }

SaverReport MapSaver::finish() {
  {
    const std::lock_guard lock(mutex_);
    over_ = true;
  }
  changed_.notify_one();
  if (thread_.joinable()) thread_.join();
  if (any_) keep_earlier();
  return report();
}

void MapSaver::take(const LiveUpdate& update) {
  const std::lock_guard lock(mutex_);
  last_ = update.view;
  newest_ = update.view;
  any_ = true;
}

void MapSaver::begin_anew() {
  {
    const std::lock_guard lock(mutex_);
    newest_.reset();
    if (!last_) return;  // nothing was in it
    ended_.push_back(std::exchange(last_, nullptr));
  }
  changed_.notify_one();
}

SaverReport MapSaver::report() const {
  const std::lock_guard lock(mutex_);
  return report_;
}

void MapSaver::work() {
  constexpr double kForever = 1e6;  // s
  const std::chrono::duration<double> pause(every_ > 0 ? every_ : kForever);
  std::unique_lock lock(mutex_);
  while (!over_ || !ended_.empty()) {
    changed_.wait_for(lock, pause, [&] { return over_ || !ended_.empty(); });
    while (!ended_.empty()) {
      const View view = std::move(ended_.front());
      ended_.erase(ended_.begin());
      lock.unlock();
      save(view, true);
      lock.lock();
    }
    if (const View view = std::exchange(newest_, nullptr); view && every_ > 0 && !over_) {
      lock.unlock();
      save(view, false);
      lock.lock();
    }
  }
}

fs::path MapSaver::free_name() const {
  std::error_code ignored;
  for (int number = 1;; ++number) {
    fs::path name = file_.stem();
    name += fmt::format("-{}", number);
    name += file_.extension();
    const fs::path numbered = file_.parent_path() / name;
    if (!fs::exists(numbered, ignored)) return numbered;
  }
}

/// Before the first map of this session takes its name.
void MapSaver::keep_earlier() {
  std::error_code failed;
  if (std::exchange(kept_earlier_, true) || !fs::is_regular_file(file_, failed)) return;
  const fs::path numbered = free_name();
  fs::rename(file_, numbered, failed);
  const std::lock_guard lock(mutex_);
  if (!failed) report_.earlier = numbered.string();
}

void MapSaver::save(const View& view, bool is_finished) {
  if (!is_finished) keep_earlier();
  const fs::path file = is_finished ? free_name() : file_;
  const Status status = io::write_lasting_file(file, io::encode_map(*view, format_of(file)));
  const std::lock_guard lock(mutex_);
  if (!status) {
    ++report_.failed;
    report_.error = status.error().message;
    return;
  }
  ++report_.saved;
  if (is_finished) report_.finished.push_back(file.string());
}

}  // namespace pade::live
