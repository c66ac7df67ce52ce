"""A flight of our own through the node of ROS 1: a bag is played, results are compared with those of `pade map`.

Run by scripts/ros, beside a roscore and a node that was started with the parameters that it gives.
"""
import argparse
import collections
import json
import os
import struct
import subprocess
import sys
import threading
import time

import rospy
from diagnostic_msgs.msg import DiagnosticArray
from nav_msgs.msg import OccupancyGrid, Path
from sensor_msgs.msg import Image, PointCloud2
from std_srvs.srv import Empty, Trigger
from visualization_msgs.msg import MarkerArray
import genpy.dynamic

problems = []


def expect(what, holds, seen=""):
    print("  %-4s %s%s" % ("ok" if holds else "BAD", what, ": %s" % (seen,) if seen != "" else ""), flush=True)
    if not holds:
        problems.append(what)


class Newest:
    """The newest message of each topic, and how many came."""

    def __init__(self):
        self.lock = threading.Lock()
        self.messages = {}
        self.counts = collections.Counter()

    def listen(self, topic, kind):
        def take(message):
            with self.lock:
                self.messages[topic] = message
                self.counts[topic] += 1

        rospy.Subscriber(topic, kind, take, queue_size=1000)

    def get(self, topic):
        with self.lock:
            return self.messages.get(topic)


def octomap_of(message):
    """octomap_msgs/Octomap by the definition that comes with it: no package of it is installed."""
    header = message._connection_header
    types = genpy.dynamic.generate_dynamic(header["type"], header["message_definition"])
    expect("octomap_msgs/Octomap has its checksum", types[header["type"]]._md5sum == "9a45536b45c5e409cd49f04bb2d9999f")
    return types[header["type"]]().deserialize(message._buff)


def data_of_file(name):
    with open(name, "rb") as file:
        content = file.read()
    return content[content.index(b"\ndata\n") + 6:]


def occupied_leaves(data):
    """Of OcTree::writeData: log-odds, then which children there are; of leaves without any, those above 0."""
    found = {}
    at = 0
    stack = [(0, 0, 0, 0)]
    while stack:
        depth, x, y, z = stack.pop()
        value, children = struct.unpack_from("<fB", data, at)
        at += 5
        if children == 0:
            if value >= 0:
                found[(depth, x, y, z)] = value
            continue
        half = 1 << (15 - depth)
        for i in range(7, -1, -1):
            if children >> i & 1:
                stack.append((depth + 1, x + (half if i & 1 else 0), y + (half if i & 2 else 0),
                              z + (half if i & 4 else 0)))
    expect("the tree ends where its bytes end", at == len(data))
    return found


def single_voxels(leaves):
    out = {}
    for (depth, x, y, z), value in leaves.items():
        side = 1 << (16 - depth)
        for dx in range(side):
            for dy in range(side):
                for dz in range(side):
                    out[(x + dx, y + dy, z + dz)] = value
    return out


def values(newest, part):
    message = newest.get("/diagnostics")
    for status in message.status if message else []:
        if status.name.endswith(": " + part):
            return dict((pair.key, pair.value) for pair in status.values), status
    return {}, None


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("bag")
    parser.add_argument("run", help="folder that pade map made of it")
    parser.add_argument("--rate", default="0.5")
    parser.add_argument("--frames", type=int, required=True)
    arguments = parser.parse_args(rospy.myargv()[1:])
    rospy.init_node("flight")
    newest = Newest()
    for topic, kind in (("/cloud", PointCloud2), ("/depth", Image), ("/sigma", Image), ("/path", Path),
                        ("/projected_map", OccupancyGrid), ("/occupied_cells_vis_array", MarkerArray),
                        ("/octomap_point_cloud_centers", PointCloud2), ("/octomap_binary", rospy.AnyMsg),
                        ("/octomap_full", rospy.AnyMsg), ("/diagnostics", DiagnosticArray)):
        newest.listen(topic, kind)
    rospy.wait_for_service("/pade/reset", 60)
    start = time.time()
    subprocess.check_call(["rosbag", "play", "--quiet", "-r", arguments.rate, arguments.bag])
    played = time.time() - start
    limit = time.time() + 600
    mapped = 0
    while time.time() < limit:
        camera, _ = values(newest, "camera")
        if camera and int(camera["received"]) == int(camera["mapped"]) + int(camera["skipped"]) + int(camera["dropped"]):
            mapped = int(camera["mapped"])
            if mapped == newest.counts["/depth"] + 1 and camera["waiting"] == "0" and mapped > 1:
                break
        time.sleep(0.5)
    time.sleep(3)  # two periods of the map
    print("played in %.1f s; done after %.1f s" % (played, time.time() - start))
    camera, _ = values(newest, "camera")
    expect("every frame is mapped", mapped == arguments.frames, camera)
    for topic in ("/cloud", "/depth", "/sigma", "/path"):
        expect("%s comes with each depth image" % topic, newest.counts[topic] == arguments.frames - 1,
               newest.counts[topic])
    for topic in ("/octomap_binary", "/octomap_full", "/occupied_cells_vis_array", "/octomap_point_cloud_centers",
                  "/projected_map"):
        expect("%s comes" % topic, newest.counts[topic] > 2, newest.counts[topic])

    binary = octomap_of(newest.get("/octomap_binary"))
    theirs = data_of_file(os.path.join(arguments.run, "map.bt"))
    ours = bytes(struct.pack("%db" % len(binary.data), *binary.data))
    expect("octomap_binary has the bytes of pade map's map.bt", ours == theirs, "%d bytes" % len(ours))
    full = octomap_of(newest.get("/octomap_full"))
    leaves = single_voxels(occupied_leaves(struct.pack("%db" % len(full.data), *full.data)))
    expected = single_voxels(occupied_leaves(data_of_file(os.path.join(arguments.run, "map.ot"))))
    expect("octomap_full has the occupied voxels of map.ot", leaves.keys() == expected.keys(), len(leaves))
    off = max([abs(leaves[key] - expected[key]) for key in leaves.keys() & expected.keys()] or [9])
    expect("and their log-odds, within 0.5 % of their range", off < 0.005 * 5.6, "%.4f" % off)
    cubes = newest.get("/occupied_cells_vis_array").markers[0].points
    expect("as many cubes", len(cubes) == len(expected), len(cubes))
    expect("as many centres", newest.get("/octomap_point_cloud_centers").width == len(expected))
    grid = newest.get("/projected_map")
    columns = len({(x, y) for x, y, _ in expected})
    expect("as many occupied cells from above", sum(1 for cell in grid.data if cell == 100) == columns, columns)
    with open(os.path.join(arguments.run, "trajectory.txt")) as file:
        rows = [line.split() for line in file if not line.startswith("#")]
    last = newest.get("/path").poses[-1].pose.position
    way = max(abs(float(a) - b) for a, b in zip(rows[-1][1:4], (last.x, last.y, last.z)))
    expect("the path ends where the trajectory does", way < 1e-5, "%.2g m" % way)

    saved = rospy.ServiceProxy("/pade/save_map", Trigger)()
    expect("save_map", saved.success, saved.message)
    if saved.success:
        with open(saved.message, "rb") as a, open(os.path.join(arguments.run, "map.bt"), "rb") as b:
            expect("writes the file that pade map wrote", a.read() == b.read())
    if "PADE_PICTURE" in os.environ:
        # For RViz, which comes late: what the node sent last.
        again = [rospy.Publisher(topic, kind, queue_size=1, latch=True) for topic, kind in
                 (("/cloud", PointCloud2), ("/path", Path))]
        for publisher in again:
            publisher.publish(newest.get(publisher.name))
        subprocess.call([os.environ["PADE_PICTURE"]])
    rospy.ServiceProxy("/pade/reset", Empty)()
    saved = rospy.ServiceProxy("/pade/save_map", Trigger)()
    expect("after reset there is no map to save", not saved.success, saved.message)
    limit = time.time() + 30
    while time.time() < limit and newest.get("/octomap_point_cloud_centers").width > 0:
        time.sleep(0.2)
    expect("and the voxels are gone", newest.get("/octomap_point_cloud_centers").width == 0)
    mapper, _ = values(newest, "mapper")
    expect("diagnostics tell latency", float(mapper["latency_ms"]) > 0, mapper["latency_ms"] + " ms")
    return 1 if problems else 0


sys.exit(main())
