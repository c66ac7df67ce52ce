// The bridge: one thread maps frames, another makes maps for who listens.
#pragma once

#include <condition_variable>
#include <deque>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <opencv2/core.hpp>
#include <pade/mapping/query/map_view.hpp>
#include <pade/pade.hpp>

#include "bridge.hpp"
#include "calibration.hpp"
#include "counts.hpp"
#include "frame_content.hpp"
#include "node_options.hpp"
#include "pose_inputs.hpp"

namespace pade_ros {

/// An image, and when it came.
struct WaitingFrame {
  Image message;
  double arrival = 0;  // steady seconds
};

class Running : public Bridge {
 public:
  Running(const NodeOptions& options, Topics topics, Sink& sink, Transforms& transforms)
      : options_(options),
        topics_(std::move(topics)),
        sink_(sink),
        transforms_(transforms),
        poses_(make_pose_input(options, topics_, transforms)),
        mapper_thread_([this] { run_mapper(); }),
        map_thread_([this] { run_maps(); }) {}
  ~Running() override {
    {
      const std::lock_guard lock(mutex_);
      over_ = true;
    }
    come_.notify_all();
    mapper_thread_.join();
    map_thread_.join();
  }

  void add(const Image& message) override;
  void add(const CameraInfo& message) override;
  void add(const PoseMessage& message) override { pass_on(message); }
  void add(const ImuMessage& message) override { pass_on(message); }
  void add(const FixMessage& message) override { pass_on(message); }
  void add(const VelocityMessage& message) override { pass_on(message); }
  void add(const FieldMessage& message) override { pass_on(message); }
  void add(const PressureMessage& message) override { pass_on(message); }
  void reset() override;
  bool save_map(const std::string& file, std::string& message) override;
  bool map_now(const Wanted& wanted, MapResult& result) override;
  std::vector<Diagnosis> diagnose() override;

 private:
  void do_between_frames(const std::function<void()>& errand);
  template <class Message>
  void pass_on(const Message& message) {
    poses_->add(message);
    come_.notify_all();
  }
  void run_mapper();
  void run_maps();
  std::optional<WaitingFrame> next_frame(PoseReply& reply);
  void pass_over_old(double now);
  void map_frame(const WaitingFrame& frame, const PoseReply& reply);
  void keep_within_the_map(const Eigen::Vector3d& place);
  [[nodiscard]] pade::Matrix6d motion_covariance(pade::Time time);
  void take_view(pade::Time time, const pade::mapping::MapChange& change);
  void forget(pade::Time time);
  void begin_anew(const std::string& why);
  void skip(const std::string& reason);
  void say(Diagnosis::Level level, const std::string& text);
  void tell(const WaitingFrame& frame, const PoseReply& reply, const pade::MapperUpdate& update,
            const cv::Mat& image);
  std::string camera_frame(const Image& message) const {
    return frame_name(options_.camera_frame.empty() ? message.frame : options_.camera_frame);
  }
  /// What the map is in: of the poses, unless it has an origin of its own.
  std::string map_world() { return origin_.isZero(0) ? poses_->world() : frame_name(options_.map_frame); }
  [[nodiscard]] pade::Time pose_time(pade::Time image) const {
    return {image.nanoseconds + static_cast<Stamp>(options_.time_offset * 1e9)};
  }

  const NodeOptions options_;
  const Topics topics_;
  Sink& sink_;
  Transforms& transforms_;
  const std::unique_ptr<PoseInput> poses_;

  std::mutex mutex_;  // of all below up to the next remark
  std::condition_variable come_;
  bool over_ = false;
  std::deque<WaitingFrame> waiting_;
  Stamp newest_ = std::numeric_limits<Stamp>::min();
  std::string anew_;                            // why the map is to be begun anew; empty: it is not
  std::vector<std::function<void()>> errands_;  // for the mapper's thread
  std::optional<CameraInfo> info_;              // as it came last
  std::shared_ptr<const Eye> eye_;              // of it
  std::string eye_problem_;                     // why there is none
  Counts counts_;
  std::map<std::string, double> said_;                  // and when
  double busy_ = 0;                                     // that a frame took lately, s
  std::shared_ptr<const pade::mapping::MapView> view_;  // null: nothing was mapped
  Stamp view_stamp_ = 0;
  std::string view_world_;
  bool view_new_ = false;
  bool ever_mapped_ = false;

  // Of the mapper's thread.
  std::shared_ptr<const Eye> mapped_eye_;
  std::optional<pade::ObstacleMapper> mapper_;
  std::size_t jumps_ = 0;
  pade::Time last_;
  std::size_t mapped_anew_ = 0;
  CameraPath path_;
  Eigen::Vector3d origin_ = Eigen::Vector3d::Zero();  // of the map, in the world of the poses

  std::thread mapper_thread_, map_thread_;
};

}  // namespace pade_ros
