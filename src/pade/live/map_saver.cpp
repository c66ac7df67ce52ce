#include "pade/live/map_saver.hpp"

#include <chrono>
#include <system_error>
#include <utility>

#include <fmt/format.h>

#include "pade/io/formats/map_files.hpp"
#include "pade/io/lasting_output.hpp"
#include "pade/mapping/query/tile_tree.hpp"

namespace pade::live {

namespace fs = std::filesystem;

namespace {

io::MapFormat format_of(const fs::path& file) {
  return file.extension() == ".ot" ? io::MapFormat::ot : io::MapFormat::bt;
}

}  // namespace

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
  SaverReport done = report();
  done.any = last_ != nullptr;
  return done;
}

Status MapSaver::write_last(const mapping::OccupancyMap& map) {
  if (Status status = keep_earlier(); !status) return status;
  return io::write_lasting_file(file_, io::encode_map(map, format_of(file_)));
}

void MapSaver::take(const LiveUpdate& update) { keep(update.view); }

void MapSaver::forget(const View& view, const mapping::MapChange& /*change*/) { keep(view); }

void MapSaver::keep(const View& view) {
  const mapping::TileBounds& known = view->tiles().bounds;
  if (known.first[0] > known.last[0]) return;
  const std::lock_guard lock(mutex_);
  last_ = view;
  newest_ = view;
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
Status MapSaver::keep_earlier() {
  std::error_code failed;
  if (kept_earlier_) return {};
  if (fs::is_regular_file(file_, failed)) {
    const fs::path numbered = free_name();
    fs::rename(file_, numbered, failed);
    if (failed)
      return Error{fmt::format("{}: the map of an earlier session cannot be moved to {}: {}", file_.string(),
                               numbered.filename().string(), failed.message())};
    const std::lock_guard lock(mutex_);
    report_.earlier = numbered.string();
  }
  kept_earlier_ = true;
  return {};
}

void MapSaver::save(const View& view, bool is_finished) {
  const fs::path file = is_finished ? free_name() : file_;
  Status status = is_finished ? Status() : keep_earlier();
  if (status) status = io::write_lasting_file(file, io::encode_map(*view, format_of(file)));
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
