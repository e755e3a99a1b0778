// Names that count cameras, and not frames: their files show one moment.
#pragma once

#include <string>

namespace restage {

/// Whether a name is a camera's, as it numbers them (cam0, Kinect_2, view 3; at most two digits) or
/// as it says where they stand (left, cam_front).
bool is_camera_name(const std::string& name);

/// Whether the text before a number is a camera's: "scan_cam", "camera_".
bool ends_in_camera(const std::string& text);

/// What helps where a folder or file holds clouds of several cameras.
inline constexpr const char* kFuseCameras =
    "fuse the clouds of all cameras of a moment into one file first (in the cameras' common axes), "
    "one file a frame";

}  // namespace restage
