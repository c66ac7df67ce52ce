"""What goes wrong with the inputs of the node of ROS 1 is said by name: in /diagnostics and in the log.

Run by scripts/ros, beside a roscore and a node in the namespace /drone with max_wait_for_pose 0.5.
"""
import random
import sys
import threading
import time

import rospy
from diagnostic_msgs.msg import DiagnosticArray
from nav_msgs.msg import Odometry
from rosgraph_msgs.msg import Log
from sensor_msgs.msg import CameraInfo, Image

WIDTH, HEIGHT, FOCAL, DISTANCE = 320, 240, 320.0, 4.0
PACE = 0.25  # s between images: a machine with other work keeps up
problems = []


def expect(what, holds, seen=""):
    print("  %-4s %s%s" % ("ok" if holds else "BAD", what, ": %s" % (seen,) if seen != "" else ""), flush=True)
    if not holds:
        problems.append(what)


class Vehicle:
    """Slides to the right along a textured wall, 5 cm from image to image."""

    def __init__(self):
        chance = random.Random(1)
        wide = WIDTH + 4000
        coarse = [[chance.randrange(256) for _ in range(wide // 4)] for _ in range(HEIGHT // 4)]
        self.wall = [bytes(b for b in coarse[v // 4] for _ in range(4)) for v in range(HEIGHT)]
        self.images = rospy.Publisher("/drone/camera/image_raw", Image, queue_size=20)
        self.infos = rospy.Publisher("/drone/camera/camera_info", CameraInfo, queue_size=20)
        self.poses = rospy.Publisher("/drone/odom", Odometry, queue_size=200)
        self.k = 0
        self.clock = 1000.0
        self.log = []
        self.status = {}
        self.lock = threading.Lock()
        rospy.Subscriber("/diagnostics", DiagnosticArray, self.take)
        rospy.Subscriber("/rosout_agg", Log, lambda m: self.log.append(m.msg))

    def take(self, message):
        with self.lock:
            for status in message.status:
                if status.name.startswith("/drone/pade: "):
                    self.status[status.name[13:]] = (status.level, status.message,
                                                     dict((v.key, v.value) for v in status.values))

    def of(self, part):
        with self.lock:
            return self.status.get(part, (0, "", {}))

    def info(self, width=WIDTH, height=HEIGHT):
        message = CameraInfo(width=width, height=height, distortion_model="plumb_bob", D=[0, 0, 0, 0, 0])
        message.header.frame_id = "camera"
        message.K = [FOCAL, 0, (WIDTH - 1) / 2, 0, FOCAL, (HEIGHT - 1) / 2, 0, 0, 1]
        message.R = [1, 0, 0, 0, 1, 0, 0, 0, 1]
        self.infos.publish(message)

    def pose(self, stamp):
        message = Odometry(child_frame_id="camera")
        message.header.frame_id = "odom"
        message.header.stamp = rospy.Time.from_sec(stamp)
        message.pose.pose.position.x = 0.05 * (stamp - 1000.0) / PACE
        message.pose.pose.orientation.w = 1
        self.poses.publish(message)

    def fly(self, count, info=True, late=0.0, poses=True, encoding="mono8", size=None):
        shift = int(FOCAL * 0.05 / DISTANCE)
        for _ in range(count):
            stamp = self.clock
            first = shift * self.k
            image = Image(width=WIDTH, height=HEIGHT, encoding=encoding, step=WIDTH)
            image.header.stamp = rospy.Time.from_sec(stamp)
            image.header.frame_id = "camera"
            image.data = b"".join(row[first:first + WIDTH] for row in self.wall)
            if info:
                self.info(*(size or (WIDTH, HEIGHT)))
            self.images.publish(image)
            if poses:
                for share in (0, 0.5):
                    at = stamp + share * PACE
                    threading.Timer(late, self.pose, [at]).start()
            self.k += 1
            self.clock += PACE
            time.sleep(PACE)

    def wait_for(self, what, holds, seen=lambda: ""):
        limit = time.time() + 30
        while time.time() < limit and not holds():
            time.sleep(0.1)
        expect(what, holds(), seen())

    def count(self, key):
        return int(self.of("camera")[2].get(key, 0))

    def said(self, text):
        return any(text in line for line in self.log)


def main():
    rospy.init_node("faults")
    rospy.wait_for_service("/drone/pade/reset", 60)
    drone = Vehicle()
    limit = time.time() + 30
    while time.time() < limit and (drone.images.get_num_connections() == 0 or drone.poses.get_num_connections() == 0
                                   or drone.infos.get_num_connections() == 0):
        time.sleep(0.1)

    drone.wait_for("nothing comes: diagnostics name the topics",
                   lambda: drone.of("camera")[1] == "no image on /drone/camera/image_raw"
                   and drone.of("camera_info")[1] == "no sensor_msgs/CameraInfo on /drone/camera/camera_info"
                   and drone.of("poses")[1] == "no nav_msgs/Odometry on /drone/odom",
                   lambda: drone.of("camera")[1])

    drone.fly(6, info=False)
    drone.wait_for("camera_info missing: the frames are skipped for it",
                   lambda: drone.count("skipped: no camera_info has come on /drone/camera/camera_info") == 6,
                   lambda: drone.of("camera")[2])
    expect("and the log says so", drone.said("no camera_info has come on /drone/camera/camera_info"))

    drone.fly(6, size=(640, 480))
    reason = "skipped: the images have 320 x 240 pixels, and camera_info is for 640 x 480"
    drone.wait_for("calibration of another size", lambda: drone.count(reason) == 6, lambda: drone.of("camera")[2])
    expect("and the log says so", drone.said(reason[9:]))

    drone.fly(8)
    drone.wait_for("all is well: frames are mapped", lambda: drone.count("mapped") == 8,
                   lambda: drone.of("camera")[2])

    before = drone.count("mapped")
    drone.fly(8, late=0.15)
    drone.wait_for("poses 150 ms late: all frames are mapped", lambda: drone.count("mapped") == before + 8,
                   lambda: drone.of("camera")[2])

    before = drone.count("skipped: no pose in time")
    drone.fly(6, late=2.5)
    time.sleep(3)
    drone.wait_for("poses 2.5 s late: the frames are skipped", lambda: drone.count("skipped: no pose in time") == before + 6,
                   lambda: drone.of("camera")[2])
    expect("and the log says so", drone.said("no pose in time"))

    drone.fly(8, poses=False)
    drone.wait_for("poses never: named with their topic",
                   lambda: drone.of("poses")[1].startswith("no nav_msgs/Odometry on /drone/odom for "),
                   lambda: drone.of("poses")[1])
    drone.wait_for("and the frames are skipped", lambda: drone.count("skipped: no pose in time") == before + 14,
                   lambda: drone.of("camera")[2])

    drone.fly(4, encoding="nonsense")
    drone.wait_for("an encoding that nobody knows", lambda: any(
        "found the encoding" in key and "nonsense" in key for key in drone.of("camera")[2]),
        lambda: [key for key in drone.of("camera")[2] if "nonsense" in key])
    expect("and the log says so", drone.said("nonsense"))

    before = drone.count("mapped")
    drone.fly(6)
    drone.wait_for("all is well again", lambda: drone.count("mapped") >= before + 5, lambda: drone.of("camera")[2])
    anew = int(drone.of("mapper")[2]["begun_anew"])
    drone.clock = 1000.0
    before = drone.count("mapped")
    drone.k = 0
    drone.fly(8)
    drone.wait_for("the time jumps back: the map is begun anew, once",
                   lambda: int(drone.of("mapper")[2]["begun_anew"]) == anew + 1
                   and drone.of("mapper")[2]["last_begun_anew"].startswith("the time went back"),
                   lambda: drone.of("mapper")[2])
    drone.wait_for("and frames are mapped", lambda: drone.count("mapped") >= before + 6, lambda: drone.of("camera")[2])
    expect("and the log says so", drone.said("the map is begun anew: the time went back"))
    waiting = drone.of("camera")[2]
    sums = [drone.count(k) for k in ("mapped", "skipped", "dropped", "waiting")]
    expect("each frame counts once", drone.count("received") == sum(sums), (waiting["received"], sums))
    return 1 if problems else 0


sys.exit(main())
