#include "pade/live/mavlink/parser.hpp"

namespace pade::live::mavlink {

SequenceWatch::Source* SequenceWatch::find(const Frame& frame) {
  for (std::size_t i = 0; i < count_; ++i) {
    if (sources_[i].system == frame.system && sources_[i].component == frame.component) return &sources_[i];
  }
  return nullptr;
}

void SequenceWatch::add(const Frame& frame, LinkCounts& counts) {
  ++counts.packets;
  const auto next = static_cast<std::uint8_t>(frame.sequence + 1);
  Source* const source = find(frame);
  if (source == nullptr) {
    if (count_ < sources_.size()) sources_[count_++] = {frame.system, frame.component, next};
    return;
  }
  if (const auto missing = static_cast<std::uint8_t>(frame.sequence - source->due); missing != 0) {
    ++counts.gaps;
    counts.lost += missing;
  }
  source->due = next;
}

void SequenceWatch::pass(const Frame& header) {
  Source* const source = find(header);
  if (source != nullptr && source->due == header.sequence) ++source->due;
}

void Parser::make_room() {
  if (begin_ == 0) return;
  const auto at = [&](std::size_t i) { return buffer_.begin() + static_cast<std::ptrdiff_t>(i); };
  std::copy(at(begin_), at(end_), buffer_.begin());
  end_ -= begin_;
  begin_ = 0;
}

bool Parser::next(Frame& frame) {
  while (begin_ < end_) {
    const Look seen = look(std::span(buffer_).subspan(begin_, end_ - begin_));
    if (seen.found == Found::incomplete) return false;
    if (seen.found == Found::frame) {
      frame = seen.frame;
      position_ = consumed_;
      begin_ += seen.length;
      consumed_ += seen.length;
      watch_.add(frame, counts_);
      return true;
    }
    if (seen.found == Found::bad_checksum) ++counts_.bad;
    if (seen.found == Found::unknown) {
      ++counts_.unknown;
      watch_.pass(seen.frame);
    }
    ++begin_;
    ++consumed_;
    ++counts_.skipped_bytes;
  }
  return false;
}

}  // namespace pade::live::mavlink
