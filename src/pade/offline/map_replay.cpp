#include "pade/offline/map_replay.hpp"

#include "pade/io/atomic_output.hpp"

namespace pade {

Result<ObstacleMapper> replay_map(const io::Sequence& sequence, const MapSequenceOptions& options,
                                  const std::function<bool(Time)>& wanted,
                                  const std::function<bool(const Frame&, const ObstacleMapper&)>& after) {
  auto mapper = ObstacleMapper::create(sequence.camera(), options.mapper, sequence.mask());
  if (!mapper) return mapper.error();
  std::size_t undecodable = 0;
  int missed = 0;
  for (std::size_t i = 0; i < sequence.size(); ++i) {
    if (wanted && !wanted(sequence.time(i))) continue;
    const Result<Frame> frame = sequence.frame(i);
    if (!frame) {
      ++missed;
      if (Status status = sequence.check(++undecodable); !status) return status.error();
      continue;
    }
    const MapperUpdate& update = mapper->add(frame->image, frame->time, frame->T_world_camera,
                                             over_missed(frame->motion_covariance, missed));
    if (update.outcome == MapperUpdate::Outcome::skipped) {
      ++missed;
      continue;
    }
    missed = 0;
    if (after && !after(*frame, *mapper)) return io::interrupted_error();
  }
  return mapper;
}

}  // namespace pade
