#include "pade/live/camera/folder_source.hpp"

#include <algorithm>
#include <chrono>
#include <thread>
#include <utility>

#include "pade/io/sequence/sequence.hpp"

namespace pade::live {
namespace {

class FolderSource : public FrameSource {
 public:
  explicit FolderSource(io::Sequence sequence) : sequence_(std::move(sequence)) {}

  Outcome next(LiveFrame& frame, int milliseconds) override {
    if (next_ >= sequence_.size()) return Outcome::ended;
    if (next_ == 0) start_ = now_of_ours();
    const std::int64_t since = sequence_.time(next_).nanoseconds - sequence_.time(0).nanoseconds;
    const Time due{start_.nanoseconds + since};
    const double wait = std::min(seconds_between(now_of_ours(), due), 1e-3 * milliseconds);
    if (wait > 0) std::this_thread::sleep_for(std::chrono::duration<double>(wait));
    if (now_of_ours() < due) return Outcome::nothing;
    const auto image = sequence_.frame(next_++);
    if (!image) return Outcome::nothing;
    frame = {image->image, due};
    return Outcome::frame;
  }
  [[nodiscard]] const Camera& camera() const override { return sequence_.camera(); }
  [[nodiscard]] cv::Mat mask() const override { return sequence_.mask(); }

 private:
  io::Sequence sequence_;
  std::size_t next_ = 0;
  Time start_;
};

}  // namespace

Time now_of_ours() {
  const auto since = std::chrono::steady_clock::now().time_since_epoch();
  return {std::chrono::duration_cast<std::chrono::nanoseconds>(since).count()};
}

Result<std::unique_ptr<FrameSource>> open_folder(const std::filesystem::path& folder,
                                                 const std::filesystem::path& calibration) {
  io::SequenceOptions options;
  options.calibration = calibration.string();
  options.poses = "autopilot";
  const io::PoseSource nowhere = [](const std::filesystem::path& /*folder*/, const std::vector<Time>& images,
                                    const io::Calibration& /*calibration*/) -> Result<io::ComputedPoses> {
    io::ComputedPoses poses;
    for (const Time time : images) poses.poses.push_back({time, Pose{}});
    poses.covariances.resize(images.size(), Matrix6d::Zero());
    return poses;
  };
  auto sequence = io::Sequence::open(folder, options, nowhere);
  if (!sequence) return sequence.error();
  return std::unique_ptr<FrameSource>(std::make_unique<FolderSource>(std::move(*sequence)));
}

}  // namespace pade::live
