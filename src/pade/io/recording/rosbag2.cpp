// rosbag2's SQLite files (.db3): tables topics and messages.
#include <cstring>
#include <map>
#include <mutex>
#include <utility>

#include <fmt/format.h>

#include "pade/io/recording/block_file.hpp"
#include "pade/io/recording/recording.hpp"

#ifdef PADE_HAS_SQLITE
#include <sqlite3.h>
#endif

namespace pade::io {

#ifndef PADE_HAS_SQLITE

Result<Recording::Content> read_rosbag2(const std::filesystem::path& file) {
  return Error{
      fmt::format("{}: a recording of rosbag2 in SQLite, which this build of pade cannot read (build it "
                  "with libsqlite3-dev)",
                  file.string())};
}

#else
namespace {

using Database = std::unique_ptr<sqlite3, int (*)(sqlite3*)>;
using Statement = std::unique_ptr<sqlite3_stmt, int (*)(sqlite3_stmt*)>;

Error sqlite_error(sqlite3* database, const std::string& name) {
  return Error{fmt::format("{}: SQLite cannot read it: {}", name, sqlite3_errmsg(database))};
}

Statement prepare(sqlite3* database, const char* text) {
  sqlite3_stmt* statement = nullptr;
  sqlite3_prepare_v2(database, text, -1, &statement, nullptr);
  return {statement, sqlite3_finalize};
}

std::string text_at(sqlite3_stmt* row, int column) {
  const auto* const text = reinterpret_cast<const char*>(sqlite3_column_text(row, column));
  return text == nullptr ? std::string()
                         : std::string(text, static_cast<std::size_t>(sqlite3_column_bytes(row, column)));
}

/// zstd's magic, with which no CDR message begins.
bool is_zstd(std::string_view bytes) { return bytes.starts_with("\x28\xB5\x2F\xFD"); }

class SqliteSource : public MessageSource {
 public:
  SqliteSource(Database database, std::string name)
      : database_(std::move(database)), name_(std::move(name)) {}

  [[nodiscard]] Result<std::string> read(const MessagePlace& place, std::size_t most) const override {
    const std::lock_guard lock(mutex_);
    const Statement row = prepare(database_.get(), "SELECT data FROM messages WHERE rowid = ?");
    if (row == nullptr) return sqlite_error(database_.get(), name_);
    sqlite3_bind_int64(row.get(), 1, static_cast<sqlite3_int64>(place.offset));
    if (sqlite3_step(row.get()) != SQLITE_ROW) return sqlite_error(database_.get(), name_);
    const auto* const data = static_cast<const char*>(sqlite3_column_blob(row.get(), 0));
    std::string bytes(data == nullptr ? "" : data,
                      static_cast<std::size_t>(sqlite3_column_bytes(row.get(), 0)));
    if (!is_zstd(bytes)) {
      if (bytes.size() > most) bytes.resize(most);
      return bytes;
    }
    return Error{
        fmt::format("{}: its messages are compressed one by one, which is not read: convert it (ros2 bag "
                    "convert) to one without compression",
                    name_)};
  }

 private:
  Database database_;
  std::string name_;
  mutable std::mutex mutex_;
};

Result<std::map<sqlite3_int64, Topic>> read_topics(sqlite3* database, const std::string& name) {
  std::map<sqlite3_int64, Topic> topics;
  const Statement row = prepare(database, "SELECT id, name, type, serialization_format FROM topics");
  if (row == nullptr) return sqlite_error(database, name);
  int state = SQLITE_ROW;
  while ((state = sqlite3_step(row.get())) == SQLITE_ROW) {
    topics[sqlite3_column_int64(row.get(), 0)] = {
        text_at(row.get(), 1), text_at(row.get(), 2), text_at(row.get(), 3), {}};
  }
  if (state != SQLITE_DONE) return sqlite_error(database, name);
  return topics;
}

Status read_places(sqlite3* database, const std::string& name, std::map<sqlite3_int64, Topic>& topics) {
  const Statement row = prepare(database, "SELECT rowid, topic_id, timestamp, length(data) FROM messages");
  if (row == nullptr) return sqlite_error(database, name);
  int state = SQLITE_ROW;
  while ((state = sqlite3_step(row.get())) == SQLITE_ROW) {
    const auto id = sqlite3_column_int64(row.get(), 0);
    const auto topic = topics.find(sqlite3_column_int64(row.get(), 1));
    if (topic == topics.end()) {
      return Error{fmt::format("{}: message {} is of topic {}, which nothing describes: it is damaged", name,
                               id, sqlite3_column_int64(row.get(), 1))};
    }
    const auto time = sqlite3_column_int64(row.get(), 2);
    if (time < 0 || time > kLastTime)
      return Error{fmt::format("{}: message {} is of time {}: it is damaged", name, id, time)};
    topic->second.messages.push_back({Time{time}, 0, static_cast<std::uint64_t>(id),
                                      static_cast<std::uint64_t>(sqlite3_column_int64(row.get(), 3))});
  }
  return state == SQLITE_DONE ? Status() : Status(sqlite_error(database, name));
}

}  // namespace

Result<Recording::Content> read_rosbag2(const std::filesystem::path& file) {
  const std::string name = file.string();
  sqlite3* raw = nullptr;
  const int state = sqlite3_open_v2(file.c_str(), &raw, SQLITE_OPEN_READONLY, nullptr);
  Database database(raw, sqlite3_close);
  if (state != SQLITE_OK) return sqlite_error(raw, name);
  // The file may be anybody's: nothing in it is to be run, and pages are to be looked at closely.
  sqlite3_db_config(raw, SQLITE_DBCONFIG_DEFENSIVE, 1, nullptr);
  sqlite3_db_config(raw, SQLITE_DBCONFIG_TRUSTED_SCHEMA, 0, nullptr);
  sqlite3_exec(raw, "PRAGMA cell_size_check = ON", nullptr, nullptr, nullptr);
  sqlite3_limit(raw, SQLITE_LIMIT_LENGTH, static_cast<int>(kLargestBlock));
  auto topics = read_topics(raw, name);
  if (!topics) return topics.error();
  if (Status status = read_places(raw, name, *topics); !status) return status.error();
  Recording::Content content;
  content.format = "rosbag2";
  for (auto& [id, topic] : *topics) content.topics.push_back(std::move(topic));
  content.source = std::make_unique<SqliteSource>(std::move(database), name);
  return content;
}
#endif

}  // namespace pade::io
