#include "pade/live/map_saver.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <optional>
#include <string_view>
#include <system_error>
#include <utility>

#include <fmt/format.h>
#include <sys/resource.h>

#include "pade/io/formats/map_files.hpp"
#include "pade/io/lasting_output.hpp"
#include "pade/io/run/run_info.hpp"
#include "pade/mapping/query/tile_tree.hpp"

namespace pade::live {

namespace fs = std::filesystem;

namespace {

io::MapFormat format_of(const fs::path& file) {
  return file.extension() == ".ot" ? io::MapFormat::ot : io::MapFormat::bt;
}

/// What may lie beside a map and belong to it.
constexpr std::array<std::string_view, 3> kOfAMap = {".json", ".bt", ".ot"};

}  // namespace

MapSaver::MapSaver(fs::path file, double every, const mapping::MapOptions& options)
    : file_(std::move(file)), every_(every), options_(options), thread_([this] { work(); }) {}

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
  return write(file_, io::encode_map(map, format_of(file_)), origin_);
}

void MapSaver::take(const LiveUpdate& update) {
  {
    const std::lock_guard lock(mutex_);
    origin_ = update.origin;
  }
  keep(update.view);
}

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
    ended_.push_back({std::exchange(last_, nullptr), origin_});
  }
  changed_.notify_one();
}

SaverReport MapSaver::report() const {
  const std::lock_guard lock(mutex_);
  return report_;
}

void MapSaver::work() {
  constexpr int kBehind = 5;
  (void)::setpriority(PRIO_PROCESS, 0, kBehind);  // this thread's: the mapper goes first
  constexpr double kForever = 1e6;                // s
  constexpr double kShare = 10;                   // a map that grows must not take more and more of the core
  double pause = every_ > 0 ? every_ : kForever;
  std::unique_lock lock(mutex_);
  while (!over_ || !ended_.empty()) {
    changed_.wait_for(lock, std::chrono::duration<double>(pause), [&] { return over_ || !ended_.empty(); });
    while (!ended_.empty()) {
      const Picture picture = std::move(ended_.front());
      ended_.erase(ended_.begin());
      lock.unlock();
      save(picture, true);
      lock.lock();
    }
    if (const Picture picture{std::exchange(newest_, nullptr), origin_};
        picture.view && every_ > 0 && !over_) {
      lock.unlock();
      const double before = io::thread_cpu_seconds();
      save(picture, false);
      pause = std::max(every_, kShare * (io::thread_cpu_seconds() - before));
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
    fs::path numbered = file_.parent_path() / name;
    const bool is_taken = std::any_of(kOfAMap.begin(), kOfAMap.end(), [&](std::string_view extension) {
      return fs::exists(fs::path(numbered).replace_extension(extension), ignored);
    });
    if (!is_taken) return numbered;
  }
}

/// Before the first map of this session takes its name. Whatever ends the program meanwhile, what belongs to
/// a map lies beside it: under both names until the map has moved.
Status MapSaver::keep_earlier() {
  std::error_code failed;
  if (kept_earlier_) return {};
  const fs::path numbered = free_name();
  const fs::path beside = io::side_car_of(file_);
  for (const std::string_view extension : kOfAMap) {
    const fs::path old = fs::path(file_).replace_extension(extension);
    const fs::path now = fs::path(numbered).replace_extension(extension);
    if (!fs::is_regular_file(old, failed)) continue;
    if (old == beside) {
      fs::create_hard_link(old, now, failed);
      if (failed) fs::copy_file(old, now, failed);  // a disk without links
    } else {
      fs::rename(old, now, failed);
    }
    if (failed)
      return Error{fmt::format("{}: the map of an earlier session cannot be moved to {}: {}", old.string(),
                               now.filename().string(), failed.message())};
    const std::lock_guard lock(mutex_);
    if (old == file_ || report_.earlier.empty() || report_.earlier == io::side_car_of(now))
      report_.earlier = now.string();
  }
  fs::remove(beside, failed);
  kept_earlier_ = true;
  return {};
}

/// A map that has ended lies under its number: the same under the name of the next, beside which soon the
/// next one's origin lies, would be a map of another place.
void MapSaver::remove_own() const {
  std::error_code ignored;
  if (!kept_earlier_) return;
  fs::remove(file_, ignored);
  fs::remove(io::side_car_of(file_), ignored);
}

/// What lies beside it first: a map without it would be read by other options.
Status MapSaver::write(const fs::path& file, const io::ByteSource& map, const Eigen::Vector3d& origin) {
  const std::string beside = io::encode_side_car(options_, std::nullopt, origin);
  if (Status status =
          io::write_lasting_file(io::side_car_of(file), [&](const io::ByteSink& sink) { sink(beside); });
      !status)
    return status;
  return io::write_lasting_file(file, map);
}

void MapSaver::save(const Picture& picture, bool is_finished) {
  const fs::path file = is_finished ? free_name() : file_;
  Status status = is_finished ? Status() : keep_earlier();
  if (status) status = write(file, io::encode_map(*picture.view, format_of(file)), picture.origin);
  if (status && is_finished) remove_own();
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
