// A skeleton and a recording in Acclaim's format (ASF, AMC): bones of any frame and freedoms, whose
// motion is known.
#pragma once

#include <cmath>
#include <cstdio>
#include <map>
#include <string>
#include <vector>

#include "nn/geometry/skeleton.h"

namespace restage::asf_test {

struct ToyBone {
  std::string name, parent;
  Vec3 end;  ///< of the bone, T-pose, from the root, metres
};
inline const std::vector<ToyBone>& toy() {
  static const std::vector<ToyBone> bones = [] {
    std::vector<ToyBone> out = {
        {"lowerback", "root", Vec3(0, .1, 0)},         {"upperback", "lowerback", Vec3(0, .22, 0)},
        {"thorax", "upperback", Vec3(0, .42, .01)},    {"lowerneck", "thorax", Vec3(0, .5, 0)},
        {"upperneck", "lowerneck", Vec3(0, .57, .01)}, {"head", "upperneck", Vec3(0, .7, .02)}};
    for (const int s : {1, -1}) {
      const std::string l = s > 0 ? "l" : "r";
      out.push_back({l + "hipjoint", "root", Vec3(s * .09, -.05, 0)});
      out.push_back({l + "femur", l + "hipjoint", Vec3(s * .1, -.45, .01)});
      out.push_back({l + "tibia", l + "femur", Vec3(s * .1, -.87, -.02)});
      out.push_back({l + "foot", l + "tibia", Vec3(s * .11, -.93, .12)});
      out.push_back({l + "toes", l + "foot", Vec3(s * .11, -.93, .18)});
      out.push_back({l + "clavicle", "thorax", Vec3(s * .18, .43, 0)});
      out.push_back({l + "humerus", l + "clavicle", Vec3(s * .45, .43, 0)});
      out.push_back({l + "radius", l + "humerus", Vec3(s * .6, .43, 0)});
      out.push_back({l + "wrist", l + "radius", Vec3(s * .7, .43, 0)});
      out.push_back({l + "hand", l + "wrist", Vec3(s * .75, .43, 0)});
    }
    return out;
  }();
  return bones;
}

inline constexpr double kToyUnit = 0.0254 / 0.45;

inline Mat3 about(int axis, double degrees) {
  return Eigen::AngleAxisd(degrees * M_PI / 180, Vec3::Unit(axis)).toRotationMatrix();
}
inline Vec3 axis_of(size_t bone) {
  return Vec3(10.0 * static_cast<double>(bone % 7), -20.0 * static_cast<double>(bone % 3),
              15.0 * static_cast<double>(bone % 5));
}
inline double angle(size_t bone, int dof, int frame) {
  return 20 * std::sin(0.7 * static_cast<double>(bone) + dof + 0.05 * frame);
}
/// Freedoms differ from bone to bone: all three, one, another order, none.
inline std::string freedoms(size_t bone) {
  const char* const kinds[] = {"xyz", "x", "zx", "", "yzx"};
  return kinds[bone % 5];
}

inline std::string asf_text() {
  std::string out =
      "# toy\n:version 1.10\n:name TOY\n:units\n  mass 1.0\n  length 0.45\n  angle deg\n"
      ":documentation\n  anything\n:root\n  order TX TY TZ RX RY RZ\n  axis XYZ\n"
      "  position 0 0 0\n  orientation 0 0 0\n:bonedata\n";
  std::map<std::string, Vec3> start = {{"root", Vec3::Zero()}};
  char line[200];
  for (size_t b = 0; b < toy().size(); ++b) {
    const ToyBone& bone = toy()[b];
    const Vec3 along = bone.end - start[bone.parent];
    start[bone.name] = bone.end;
    const Vec3 d = along.normalized(), a = axis_of(b);
    std::snprintf(line, sizeof line,
                  "  begin\n    id %zu\n    name %s\n    direction %.9g %.9g %.9g\n    length "
                  "%.9g\n    axis %g %g %g XYZ\n",
                  b + 1, bone.name.c_str(), d.x(), d.y(), d.z(), along.norm() / kToyUnit, a.x(),
                  a.y(), a.z());
    out += line;
    if (!freedoms(b).empty()) {
      out += "    dof";
      for (const char c : freedoms(b)) out += std::string(" r") + c;
      out += "\n    limits";
      for (size_t i = 0; i < freedoms(b).size(); ++i) out += " (-160.0 20.0)\n          ";
      out += "\n";
    }
    out += "  end\n";
  }
  out += ":hierarchy\n  begin\n";
  for (const ToyBone& bone : toy()) out += "    " + bone.parent + " " + bone.name + "\n";
  return out + "  end\n";
}

inline std::string amc_text(int frames) {
  std::string out = "#!OML:ASF\n:FULLY-SPECIFIED\n:DEGREES\n";
  for (int f = 0; f < frames; ++f) {
    char line[200];
    std::snprintf(line, sizeof line, "%d\nroot %.9g %.9g %.9g %.9g %.9g %.9g\n", f + 1,
                  0.01 * f / kToyUnit, 0.95 / kToyUnit, 0.002 * f / kToyUnit, 5.0, 20.0 + 0.1 * f,
                  -3.0);
    out += line;
    for (size_t b = 0; b < toy().size(); ++b) {
      if (freedoms(b).empty()) continue;
      out += toy()[b].name;
      for (size_t d = 0; d < freedoms(b).size(); ++d) {
        std::snprintf(line, sizeof line, " %.9g", angle(b, static_cast<int>(d), f));
        out += line;
      }
      out += "\n";
    }
  }
  return out;
}

}  // namespace restage::asf_test
