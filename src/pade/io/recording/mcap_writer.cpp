// MCAP, uncompressed, with checksums and index.
#include <map>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "pade/core/version.hpp"
#include "pade/io/crc32.hpp"
#include "pade/io/recording/mcap_format.hpp"
#include "pade/io/recording/messages/message_definitions.hpp"
#include "pade/io/recording/recording_writer.hpp"

namespace pade::io {
namespace {

constexpr std::size_t kChunkBytes = 1024 * 1024;

/// The content of a record.
class Fields {
 public:
  template <class Number>
  Fields& number(Number value) {
    bytes_.append(reinterpret_cast<const char*>(&value), sizeof(value));
    return *this;
  }
  Fields& text(std::string_view text) {
    number(static_cast<std::uint32_t>(text.size()));
    bytes_ += text;
    return *this;
  }
  Fields& raw(std::string_view bytes) {
    bytes_ += bytes;
    return *this;
  }
  /// As a record of that number.
  [[nodiscard]] std::string record(std::uint8_t operation) const {
    Fields out;
    out.number(operation).number(static_cast<std::uint64_t>(bytes_.size())).raw(bytes_);
    return out.bytes_;
  }
  [[nodiscard]] const std::string& bytes() const { return bytes_; }

 private:
  std::string bytes_;
};

std::uint64_t nanoseconds(Time time) { return static_cast<std::uint64_t>(time.nanoseconds); }

class McapWriter : public RecordingWriter {
 public:
  explicit McapWriter(PartialFile file) : file_(std::move(file)) {
    append(mcap::kMagic);
    append(Fields().text("ros2").text(fmt::format("pade {}", version)).record(mcap::kHeader));
  }

  [[nodiscard]] MessageEncoding encoding() const override { return MessageEncoding::cdr; }

  Status write(std::string_view topic, std::string_view type, Time time, std::string_view message) override {
    const auto [known, added] = channels_.try_emplace(std::string(topic));
    Channel& channel = known->second;
    if (added) {
      channel.number = static_cast<std::uint16_t>(channels_.size());
      channel.records = describe(topic, type, channel.number);
      chunk_ += channel.records;
    }
    if (in_chunk_ == 0) chunk_first_ = chunk_last_ = time;
    chunk_first_ = std::min(chunk_first_, time);
    chunk_last_ = std::max(chunk_last_, time);
    if (messages_ == 0) first_ = last_ = time;
    first_ = std::min(first_, time);
    last_ = std::max(last_, time);
    ++in_chunk_;
    ++messages_;
    channel.places.emplace_back(time, chunk_.size());
    chunk_ += Fields()
                  .number(channel.number)
                  .number(static_cast<std::uint32_t>(channel.count++))
                  .number(nanoseconds(time))
                  .number(nanoseconds(time))
                  .raw(message)
                  .record(mcap::kMessage);
    return chunk_.size() < kChunkBytes ? Status() : end_chunk();
  }

  Status flush() override {
    if (Status status = end_chunk(); !status) return status;
    return file_.flush();
  }

  Status finish() override {
    if (Status status = end_chunk(); !status) return status;
    append(Fields().number(crc_.value()).record(mcap::kDataEnd));
    const std::uint64_t summary = file_.size();
    std::string groups;
    std::string offsets;
    const auto end_group = [&](std::uint8_t operation, std::size_t begin) {
      if (groups.size() == begin) return;
      offsets += Fields()
                     .number(operation)
                     .number(summary + begin)
                     .number(static_cast<std::uint64_t>(groups.size() - begin))
                     .record(mcap::kSummaryOffset);
    };
    for (const std::string& schema : schemas_) groups += schema;
    end_group(mcap::kSchema, 0);
    std::size_t begin = groups.size();
    for (const std::string& channel : channel_records_) groups += channel;
    end_group(mcap::kChannel, begin);
    begin = groups.size();
    groups += statistics();
    end_group(mcap::kStatistics, begin);
    begin = groups.size();
    for (const std::string& index : chunk_indices_) groups += index;
    end_group(mcap::kChunkIndex, begin);
    const std::uint64_t offset_start = summary + groups.size();
    groups += offsets;
    std::string footer =
        Fields().number(summary).number(offset_start).number(std::uint32_t{0}).record(mcap::kFooter);
    footer.resize(footer.size() - sizeof(std::uint32_t));
    Crc32 crc;
    crc.add(groups.data(), groups.size());
    crc.add(footer.data(), footer.size());
    append(groups);
    append(footer);
    append(Fields().number(crc.value()).bytes());
    append(mcap::kMagic);
    return file_.commit();
  }

 private:
  struct Channel {
    std::uint16_t number = 0;
    std::string records;                                 ///< schema, if it is new, and channel
    std::vector<std::pair<Time, std::uint64_t>> places;  ///< of its messages in the chunk
    std::uint64_t count = 0;
  };

  void append(std::string_view bytes) {
    file_.append(bytes);
    crc_.add(bytes.data(), bytes.size());
  }

  /// The records that describe a channel.
  std::string describe(std::string_view topic, std::string_view type, std::uint16_t number) {
    std::string name(type);
    name.insert(name.find('/'), "/msg");
    const auto [schema, added] =
        schema_ids_.try_emplace(name, static_cast<std::uint16_t>(schema_ids_.size() + 1));
    std::string records;
    if (added) {
      schemas_.push_back(Fields()
                             .number(schema->second)
                             .text(name)
                             .text("ros2msg")
                             .text(message_definition(type, MessageEncoding::cdr))
                             .record(mcap::kSchema));
      records = schemas_.back();
    }
    channel_records_.push_back(Fields()
                                   .number(number)
                                   .number(schema->second)
                                   .text(topic)
                                   .text("cdr")
                                   .number(std::uint32_t{0})  // no metadata
                                   .record(mcap::kChannel));
    return records + channel_records_.back();
  }

  Status end_chunk() {
    if (in_chunk_ == 0) return {};
    const std::uint64_t place = file_.size();
    const std::string record = Fields()
                                   .number(nanoseconds(chunk_first_))
                                   .number(nanoseconds(chunk_last_))
                                   .number(static_cast<std::uint64_t>(chunk_.size()))
                                   .number(crc32(chunk_.data(), chunk_.size()))
                                   .text("")
                                   .number(static_cast<std::uint64_t>(chunk_.size()))
                                   .raw(chunk_)
                                   .record(mcap::kChunk);
    append(record);
    Fields offsets;
    std::uint64_t indices = 0;
    for (auto& [topic, channel] : channels_) {
      if (channel.places.empty()) continue;
      offsets.number(channel.number).number(file_.size());
      Fields entries;
      for (const auto& [time, offset] : channel.places) entries.number(nanoseconds(time)).number(offset);
      const std::string index =
          Fields().number(channel.number).text(entries.bytes()).record(mcap::kMessageIndex);
      append(index);
      indices += index.size();
      channel.places.clear();
    }
    chunk_indices_.push_back(Fields()
                                 .number(nanoseconds(chunk_first_))
                                 .number(nanoseconds(chunk_last_))
                                 .number(place)
                                 .number(static_cast<std::uint64_t>(record.size()))
                                 .text(offsets.bytes())
                                 .number(indices)
                                 .text("")
                                 .number(static_cast<std::uint64_t>(chunk_.size()))
                                 .number(static_cast<std::uint64_t>(chunk_.size()))
                                 .record(mcap::kChunkIndex));
    chunk_.clear();
    in_chunk_ = 0;
    return file_.flush();
  }

  [[nodiscard]] std::string statistics() const {
    Fields counts;
    for (const auto& [topic, channel] : channels_) counts.number(channel.number).number(channel.count);
    return Fields()
        .number(messages_)
        .number(static_cast<std::uint16_t>(schema_ids_.size()))
        .number(static_cast<std::uint32_t>(channels_.size()))
        .number(std::uint32_t{0})  // attachments
        .number(std::uint32_t{0})  // metadata
        .number(static_cast<std::uint32_t>(chunk_indices_.size()))
        .number(nanoseconds(first_))
        .number(nanoseconds(last_))
        .text(counts.bytes())
        .record(mcap::kStatistics);
  }

  PartialFile file_;
  Crc32 crc_;                                // of all that was appended: the data section, until it ends
  std::map<std::string, Channel> channels_;  // by topic
  std::map<std::string, std::uint16_t> schema_ids_;  // by name
  std::vector<std::string> schemas_, channel_records_, chunk_indices_;
  std::string chunk_;
  Time chunk_first_, chunk_last_, first_, last_;
  std::size_t in_chunk_ = 0;
  std::uint64_t messages_ = 0;
};

}  // namespace

std::unique_ptr<RecordingWriter> mcap_writer(PartialFile file) {
  return std::make_unique<McapWriter>(std::move(file));
}

}  // namespace pade::io
