"""A flight by IMU and GNSS through our own filter, and once more by the transforms that come of it. Run by scripts/ros."""
import argparse
import os
import subprocess
import sys
import threading
import time

import rospy
from diagnostic_msgs.msg import DiagnosticArray
from nav_msgs.msg import Path
from tf2_msgs.msg import TFMessage

problems = []


def expect(what, holds, seen=""):
    print("  %-4s %s%s" % ("ok" if holds else "BAD", what, ": %s" % (seen,) if seen != "" else ""), flush=True)
    if not holds:
        problems.append(what)


def way(rows):
    return [rows[-1][axis] - rows[0][axis] for axis in range(3)]


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("bag")
    parser.add_argument("run", help="folder that pade map made of it, by its poses")
    parser.add_argument("--rate", default="0.5")
    parser.add_argument("--frames", type=int, required=True)
    arguments = parser.parse_args(rospy.myargv()[1:])
    rospy.init_node("sensors")
    lock = threading.Lock()
    status, newest, transforms = {}, {}, []

    def take(message):
        with lock:
            for one in message.status:
                status[one.name] = (one.message, dict((pair.key, pair.value) for pair in one.values))

    rospy.Subscriber("/diagnostics", DiagnosticArray, take)
    for node in ("own", "by_tf"):
        rospy.Subscriber("/%s/path" % node, Path, lambda m, node=node: newest.__setitem__(node, m))
        rospy.wait_for_service("/%s/pade/reset" % node, 60)
    rospy.Subscriber("/tf", TFMessage, lambda m: transforms.extend(m.transforms))
    subprocess.check_call(["rosbag", "play", "--quiet", "-r", arguments.rate, arguments.bag])

    def counts(node):
        with lock:
            values = status.get("/%s/pade: camera" % node, ("", {}))[1]
        return [int(values.get(key, -1)) for key in ("received", "mapped", "skipped", "dropped", "waiting")]

    limit = time.time() + 300
    while time.time() < limit and any(counts(node)[4] != 0 or counts(node)[0] != sum(counts(node)[1:])
                                      for node in ("own", "by_tf")):
        time.sleep(0.5)
    time.sleep(1.5)
    print("  filter: %s" % status["/own/pade: poses"][0])
    own, by_tf = counts("own"), counts("by_tf")
    expect("our filter: at least nine frames of ten are mapped", own[1] >= 0.9 * arguments.frames, status["/own/pade: camera"][1])
    expect("by transforms: as many, but for those at the ends", by_tf[1] >= own[1] - 3, status["/by_tf/pade: camera"][1])
    with open(os.path.join(arguments.run, "trajectory.txt")) as file:
        truth = [[float(word) for word in line.split()] for line in file if not line.startswith("#")]
    for node in ("own", "by_tf"):
        poses = [(p.header.stamp.to_sec(), p.pose.position) for p in newest[node].poses]
        rows = [[p.x, p.y, p.z] for _, p in poses]
        inside = [row[1:4] for row in truth if poses[0][0] - 1e-3 <= row[0] <= poses[-1][0] + 1e-3]
        off = sum((a - b) ** 2 for a, b in zip(way(rows), way(inside))) ** 0.5
        long = sum(b * b for b in way(inside)) ** 0.5
        expect("%s: the way is that of the truth" % node, off < 0.1 * long and long > 3, "%.2f m off in %.1f m" % (off, long))
    expect("the filter's pose is a transform", transforms and transforms[-1].header.frame_id == "map", len(transforms))
    return 1 if problems else 0


sys.exit(main())
