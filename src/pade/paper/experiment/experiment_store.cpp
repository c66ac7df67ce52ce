#include "pade/paper/experiment/experiment_store.hpp"

#include <algorithm>
#include <fstream>
#include <system_error>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "pade/core/fingerprint.hpp"
#include "pade/io/atomic_output.hpp"
#include "pade/io/text.hpp"

namespace pade::experiment {
namespace fs = std::filesystem;
namespace {

using Json = nlohmann::ordered_json;

std::string old_timings(const fs::path& file) {
  const auto text = io::read_file(file);
  if (!text) return "{}";
  const Json json = Json::parse(*text, nullptr, false);
  return json.is_object() && json.contains("jobs") ? json["jobs"].dump() : "{}";
}

}  // namespace

Status Store::check(const fs::path& out, bool again) {
  std::error_code code;
  const bool there = io::path_exists(out);
  if (there && !fs::is_directory(out, code)) {
    return Error{fmt::format("{}: found a file, expected a folder or nothing", out.string())};
  }
  const bool ours = io::path_exists(out / plan_file);
  if (there && !ours && !fs::is_empty(out, code)) {
    return Error{fmt::format("{}: found a folder without {}, expected that of an experiment or nothing",
                             out.string(), plan_file)};
  }
  if (ours && !again && io::path_exists(out / finished_file)) {
    return Error{fmt::format(
        "{}: the experiment is finished; choose another name or redo its tables with --force", out.string())};
  }
  return {};
}

Result<Store> Store::open(const fs::path& out, bool again) {
  if (Status usable = check(out, again); !usable) return usable.error();
  std::error_code code;
  fs::create_directories(out / "jobs", code);
  for (const char* folder : {"timing", "figures"}) {
    if (!code) fs::create_directories(out / folder, code);
  }
  if (code) return Error{fmt::format("{}: cannot be made: {}", out.string(), code.message())};
  Store store(out);
  store.old_timing_ = old_timings(out / timing_file);
  return store;
}

Result<Store> Store::read_only(const fs::path& folder) {
  if (!io::path_exists(folder / plan_file)) {
    return Error{
        fmt::format("{}: found no {}, expected the folder of an experiment", folder.string(), plan_file)};
  }
  Store store(folder);
  store.old_timing_ = old_timings(folder / timing_file);
  return store;
}

fs::path Store::place(std::string_view job, bool timing) const {
  return folder_ / (timing ? "timing" : "jobs") / fmt::format("{}.json", job);
}

bool Store::has(std::string_view job, bool timing) const { return read(job, timing).ok(); }

Result<std::string> Store::read(std::string_view job, bool timing) const {
  const fs::path file = place(job, timing);
  if (!timing || io::path_exists(file)) return io::read_file(file);
  const Json old = Json::parse(old_timing_);
  if (!old.contains(job)) return Error{fmt::format("{}: found no such file", file.string())};
  return old.at(std::string(job)).dump();
}

Status Store::write(std::string_view job, bool timing, std::string_view content) const {
  return io::write_file(place(job, timing), content, io::Overwrite::replace);
}

Status Store::write_file(std::string_view name, std::string_view content) const {
  return io::write_file(folder_ / name, content, io::Overwrite::replace);
}

Status Store::tidy_up(std::string_view timing_json) const {
  if (Status written = write_file(timing_file, timing_json); !written) return written;
  std::error_code code;
  fs::remove_all(folder_ / "timing", code);
  if (fs::is_empty(folder_ / "figures", code)) fs::remove(folder_ / "figures", code);
  for (const fs::path& folder : {folder_, folder_ / "jobs", folder_ / "figures"}) {
    std::vector<fs::path> hidden;
    for (const auto& entry : fs::directory_iterator(folder, code)) {
      if (entry.path().filename().string().starts_with(".")) hidden.push_back(entry.path());
    }
    for (const fs::path& file : hidden) fs::remove(file, code);
  }
  return {};
}

Result<std::string> folder_fingerprint(const fs::path& folder) {
  std::vector<fs::path> files;
  std::error_code code;
  for (fs::recursive_directory_iterator it(folder, code), end; !code && it != end; it.increment(code)) {
    const bool hidden = it->path().filename().string().starts_with(".");
    if (hidden && it->is_directory(code)) it.disable_recursion_pending();
    if (!hidden && it->is_regular_file(code)) files.push_back(it->path());
  }
  if (code) return Error{fmt::format("{}: cannot be read: {}", folder.string(), code.message())};
  std::sort(files.begin(), files.end());
  Fingerprint fingerprint;
  std::vector<char> buffer(1U << 20U);
  for (const fs::path& file : files) {
    fingerprint.text(file.lexically_relative(folder).generic_string());
    std::ifstream stream(file, std::ios::binary);
    if (!stream) return Error{fmt::format("{}: cannot be read", file.string())};
    while (stream) {
      if (io::interrupted()) return io::interrupted_and_kept_error();
      stream.read(buffer.data(), static_cast<std::streamsize>(buffer.size()));
      fingerprint.bytes(buffer.data(), static_cast<std::size_t>(stream.gcount()));
    }
    fingerprint.text("");
  }
  return fingerprint.hex();
}

}  // namespace pade::experiment
