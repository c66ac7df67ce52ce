"""One vehicle; for several, namespace:=a and so on."""
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node

TOPICS = {
    "image": "camera/image_raw",
    "camera_info": "camera/camera_info",
    "odometry": "odom",
    "pose": "pose",
    "imu": "imu/data",
    "fix": "gps/fix",
    "velocity": "gps/fix_velocity",
    "magnetic_field": "imu/mag",
    "pressure": "pressure",
}


def generate_launch_description():
    arguments = [
        DeclareLaunchArgument("namespace", default_value=""),
        DeclareLaunchArgument("poses", default_value="odometry", description="odometry, pose, tf or sensors"),
        DeclareLaunchArgument("compressed", default_value="false"),
        DeclareLaunchArgument("map_file", default_value="map.bt"),
    ]
    arguments += [DeclareLaunchArgument(name, default_value=topic) for name, topic in TOPICS.items()]
    node = Node(
        package="pade_ros",
        executable="pade_node",
        name="pade",
        namespace=LaunchConfiguration("namespace"),
        output="screen",
        parameters=[{name: LaunchConfiguration(name) for name in ("poses", "compressed", "map_file")}],
        remappings=[(name, LaunchConfiguration(name)) for name in TOPICS],
    )
    return LaunchDescription(arguments + [node])
