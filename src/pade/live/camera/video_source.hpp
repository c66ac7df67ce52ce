// Video files and network streams as cameras.
#pragma once

#include <memory>
#include <string>

#include "pade/core/camera.hpp"
#include "pade/core/result.hpp"
#include "pade/live/interfaces.hpp"

namespace pade::live {

struct VideoModule;

/// The module for videos (video_module.hpp), loaded when it is first asked for, or why there is none.
const Result<const VideoModule*>& video_module();

/// Whether it names a stream rather than a file: rtsp://192.168.0.10/main.
bool is_stream(const std::string& name);

/// Opens a video in the size of its calibration. A file is played at its real pace: the first frame comes at
/// once, its stamp is that moment of our clock. A stream (RTSP, over TCP where the sender can, and what else
/// FFmpeg opens by such an address) has the stamps of its sender, laid into our clock by the least delay
/// (VideoClock): they are late by that delay, which session.time_offset is for; where its format has no
/// stamps (motion JPEG over HTTP) each frame has the time at which it arrived. Of frames that wait the newest
/// two are kept. A stream that ends, or is silent for a second, is opened again twice a second, and
/// the frames of its first half second are left out; so are frames that are damaged, have no stamp, or
/// another size. Errors: no such file, nothing in it that can be decoded, no stamps in its format, another
/// size, pictures to be turned by no multiple of 90 degrees, or no module for videos; a stream that is not
/// there yet is waited for.
/// @param camera  as calibrated, with its distortion; images are undistorted
Result<std::unique_ptr<FrameSource>> open_video(const std::string& name, const Camera& camera);

}  // namespace pade::live
