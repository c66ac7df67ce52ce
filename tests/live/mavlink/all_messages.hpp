// Every message that has a table.
#pragma once

#include "pade/live/mavlink/estimate_messages.hpp"
#include "pade/live/mavlink/link_messages.hpp"
#include "pade/live/mavlink/sensor_messages.hpp"

namespace pade::live::mavlink {

template <class... Messages>
struct List {};
using AllMessages =
    List<Heartbeat, SystemTime, GpsRawInt, ScaledImu, RawImu, ScaledPressure, Attitude, AttitudeQuaternion,
         LocalPositionNed, GlobalPositionInt, GpsGlobalOrigin, CommandLong, CommandAck, HighresImu, Timesync,
         CameraTrigger, StatusText, CameraImageCaptured, ObstacleDistance, Odometry, OnboardComputerStatus,
         ObstacleDistance3d>;

template <class... Messages, class Do>
void for_each_message(List<Messages...> /*list*/, Do&& act) {
  (act(Messages{}), ...);
}

}  // namespace pade::live::mavlink
