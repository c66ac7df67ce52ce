"""Debian's rosbag: writes a flight folder as a bag, and says what is in a bag. Used by scripts/recording-oracle.

    peer_rosbag.py write FLIGHT OUT.bag none|bz2|lz4
    peer_rosbag.py read FILE.bag
"""
import hashlib
import os
import struct
import sys

import rosbag
import rospy
from geometry_msgs.msg import Point, Quaternion
from nav_msgs.msg import Odometry
from sensor_msgs.msg import CameraInfo, CompressedImage


def stamp_of(text):
    seconds, _, fraction = text.partition(".")
    return rospy.Time(int(seconds), int((fraction + "000000000")[:9]))


def rows_of(path):
    with open(path) as file:
        return [line.split() for line in file if line.strip() and not line.startswith("#")]


def camera_of(flight):
    fields = {}
    with open(os.path.join(flight, "camera.yaml")) as file:
        for line in file:
            key, _, value = line.partition("#")[0].partition(":")
            fields[key.strip()] = value.strip().strip('"')
    return fields


def images_of(flight):
    if os.path.exists(os.path.join(flight, "rgb.txt")):
        return [(row[0], os.path.join(flight, row[1])) for row in rows_of(os.path.join(flight, "rgb.txt"))]
    folder = os.path.join(flight, "rgb")
    return [(os.path.splitext(name)[0], os.path.join(folder, name)) for name in sorted(os.listdir(folder))]


def write(flight, out, compression):
    camera = camera_of(flight)
    fx, fy, cx, cy = (float(camera[key]) for key in ("fx", "fy", "cx", "cy"))
    distortion = camera.get("distortion", "[]").strip("[]")
    with rosbag.Bag(out, "w", compression=compression) as bag:
        for text, path in images_of(flight):
            stamp = stamp_of(text)
            info = CameraInfo(width=int(camera["width"]), height=int(camera["height"]))
            info.header.stamp, info.header.frame_id = stamp, "camera"
            info.distortion_model = "plumb_bob" if camera["distortion_model"] == "none" else camera["distortion_model"]
            info.D = [float(value) for value in distortion.split(",") if value.strip()]
            if camera["distortion_model"] == "none":
                info.D = []
            info.K = [fx, 0, cx, 0, fy, cy, 0, 0, 1]
            info.R = [1, 0, 0, 0, 1, 0, 0, 0, 1]
            info.P = [fx, 0, cx, 0, 0, fy, cy, 0, 0, 0, 1, 0]
            bag.write("/camera/camera_info", info, stamp)
            image = CompressedImage(format="png" if path.endswith(".png") else "jpeg")
            image.header.stamp, image.header.frame_id = stamp, "camera"
            with open(path, "rb") as file:
                image.data = file.read()
            bag.write("/camera/image_raw/compressed", image, stamp)
        for row in rows_of(os.path.join(flight, "groundtruth.txt")):
            odometry = Odometry(child_frame_id="camera")
            odometry.header.stamp, odometry.header.frame_id = stamp_of(row[0]), "map"
            odometry.pose.pose.position = Point(*(float(value) for value in row[1:4]))
            odometry.pose.pose.orientation = Quaternion(*(float(value) for value in row[4:8]))
            bag.write("/odom", odometry, odometry.header.stamp)


def bits(values):
    return ",".join(struct.pack(">d", value).hex() for value in values)


def line_of(topic, message):
    head = "%s %d.%09d %s " % (topic, message.header.stamp.secs, message.header.stamp.nsecs, message.header.frame_id)
    if hasattr(message, "data"):
        return head + message.format + " " + hashlib.sha256(bytes(message.data)).hexdigest()
    if hasattr(message, "K"):
        return head + "%d %d %s %s %s" % (message.width, message.height, message.distortion_model, bits(message.D),
                                          bits(message.K))
    place, turn = message.pose.pose.position, message.pose.pose.orientation
    turn = (turn.x, turn.y, turn.z, turn.w)
    norm = sum(value * value for value in turn) ** 0.5  # ours are of unit length
    return head + message.child_frame_id + " " + bits((place.x, place.y, place.z)) + " " + ",".join(
        "%.10f" % (value / norm) for value in turn)


def read(path):
    lines = []
    with rosbag.Bag(path) as bag:
        for topic, message, _ in bag.read_messages():
            if topic in ("/camera/camera_info", "/camera/image_raw/compressed", "/odom"):
                lines.append(line_of(topic, message))
    print("\n".join(sorted(lines)))


if sys.argv[1] == "write":
    write(*sys.argv[2:])
else:
    read(sys.argv[2])
