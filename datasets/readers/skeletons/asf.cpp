#include "datasets/readers/skeletons/asf.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "datasets/readers/errors.h"
#include "datasets/readers/text/word_lines.h"

namespace restage {
namespace {

constexpr size_t kMaxBones = 4096;
constexpr double kDegrees = 180.0 / M_PI;

/// "XYZ" as axes; the first is applied first.
std::array<Channel, 3> axis_order(const WordLines& lines, std::string_view word) {
  std::array<Channel, 3> out{};
  const std::string order = lower_case(word);
  std::string sorted = order;
  std::sort(sorted.begin(), sorted.end());
  if (sorted != "xyz")
    lines.fail("'" + WordLines::quoted(word) + "' is no order of axes", "write XYZ or another");
  for (size_t i = 0; i < 3; ++i)
    out[i] = static_cast<Channel>(static_cast<int>(Channel::x_rotation) + (order[i] - 'x'));
  return out;
}

Quat in_order(const std::array<Channel, 3>& axes, const Vec3& degrees) {
  Quat out = Quat::Identity();
  for (const Channel axis : axes) out = channel_rotation(axis, degrees[axis_of(axis)]) * out;
  return out;
}

AsfFreedom freedom(const WordLines& lines, std::string_view word) {
  constexpr std::pair<std::string_view, Channel> kNames[] = {
      {"rx", Channel::x_rotation}, {"ry", Channel::y_rotation}, {"rz", Channel::z_rotation},
      {"tx", Channel::x_position}, {"ty", Channel::y_position}, {"tz", Channel::z_position}};
  for (const auto& [name, channel] : kNames)
    if (same_word(word, name)) return channel;
  if (same_word(word, "l")) return std::nullopt;
  lines.fail("'" + WordLines::quoted(word) + "' is no freedom of a bone",
             "use TX, TY, TZ, RX, RY, RZ or L");
}

/// ASF sections are lines ":name"; inside, bones and the hierarchy stand between begin and end.
class AsfParser {
 public:
  AsfParser(std::string_view text, const std::string& path) : lines_(text, path), path_(path) {}

  AsfFile parse() {
    asf_.bones.emplace_back().name = "root";
    asf_.root_axes = {Channel::x_rotation, Channel::y_rotation, Channel::z_rotation};
    std::string section;
    while (lines_.next()) {
      const std::string_view word = lines_.words()[0];
      if (word[0] == '#') continue;
      if (word[0] == ':') {
        section = lower_case(word);
        any_section_ = true;
      } else if (!any_section_) {
        lines_.fail("does not begin with a section such as :version", "give an ASF file");
      } else if (section == ":units") {
        unit();
      } else if (section == ":root") {
        root();
      } else if (section == ":bonedata") {
        bone_line();
      } else if (section == ":hierarchy") {
        hierarchy_line();
      }  // :version, :name, :documentation, :skin say nothing of the skeleton
    }
    return finish();
  }

 private:
  Vec3 vector(size_t first, const char* what) const {
    if (words().size() < first + 3) lines_.fail(cat(what, " needs three numbers"), "write them");
    return Vec3(lines_.number(words()[first]), lines_.number(words()[first + 1]),
                lines_.number(words()[first + 2]));
  }
  const std::vector<std::string_view>& words() const { return lines_.words(); }

  void unit() {
    if (words().size() < 2) return;
    if (same_word(words()[0], "length")) {
      asf_.length_unit = lines_.number(words()[1]);
      if (!(asf_.length_unit > 0)) lines_.fail("a unit of length must be positive", "correct it");
    }
    if (same_word(words()[0], "angle")) asf_.radians = same_word(words()[1], "rad");
  }

  void root() {
    AsfBone& bone = asf_.bones[0];
    if (same_word(words()[0], "order")) {
      bone.freedoms.clear();
      for (size_t i = 1; i < words().size(); ++i) add_freedom(bone, words()[i]);
    } else if (same_word(words()[0], "axis") && words().size() > 1) {
      asf_.root_axes = axis_order(lines_, words()[1]);
    } else if (same_word(words()[0], "position")) {
      asf_.root_position = vector(1, "position");
    } else if (same_word(words()[0], "orientation")) {
      orientation_ = vector(1, "orientation");
    }
  }

  void add_freedom(AsfBone& bone, std::string_view word) {
    const AsfFreedom one = freedom(lines_, word);
    if (std::find(bone.freedoms.begin(), bone.freedoms.end(), one) != bone.freedoms.end())
      lines_.fail("a freedom given twice for one bone", "keep one");
    bone.freedoms.push_back(one);
  }

  void bone_line() {
    const std::string_view key = words()[0];
    if (same_word(key, "begin")) {
      if (in_bone_) lines_.fail("'begin' in a bone", "end the bone before");
      if (asf_.bones.size() >= kMaxBones) lines_.fail("more than 4096 bones", "give a person's");
      asf_.bones.emplace_back();
      in_bone_ = true;
    } else if (!in_bone_) {
      lines_.fail("'begin' expected", "give each bone between begin and end");
    } else if (same_word(key, "end")) {
      end_bone();
    } else {
      in_limits_ = in_limits_ && key[0] == '(';
      bone_entry(asf_.bones.back(), lower_case(key));
    }
  }

  void bone_entry(AsfBone& bone, const std::string& key) {
    if (key == "name") {
      if (words().size() < 2) lines_.fail("a bone without a name", "give it one");
      bone.name = words()[1];
    } else if (key == "direction") {
      bone.direction = vector(1, "direction");
    } else if (key == "length") {
      if (words().size() < 2) lines_.fail("length needs a number", "write it");
      bone.length = lines_.number(words()[1]);
    } else if (key == "axis") {
      const Vec3 angles = vector(1, "axis");
      const std::array<Channel, 3> order =
          axis_order(lines_, words().size() > 4 ? words()[4] : std::string_view("XYZ"));
      bone.axis = in_order(order, asf_.radians ? Vec3(angles * kDegrees) : angles);
    } else if (key == "dof") {
      for (size_t i = 1; i < words().size(); ++i) add_freedom(bone, words()[i]);
    } else if (key == "limits" || in_limits_) {
      in_limits_ = true;
      limits(bone, key == "limits" ? 1 : 0);
    }  // id, bodymass, cofmass: nothing of the skeleton
  }

  /// "(-160.0 20.0)", with any blanks.
  void limits(AsfBone& bone, size_t first) {
    std::string text;
    for (size_t i = first; i < words().size(); ++i) text += cat(words()[i], " ");
    for (char& c : text)
      if (c == '(' || c == ')' || c == ',') c = ' ';
    std::vector<double> values;
    for (size_t at = text.find_first_not_of(' '); at != std::string::npos;) {
      const size_t end = std::min(text.find(' ', at), text.size());
      const std::string word = text.substr(at, end - at);
      const bool endless = same_word(word, "inf") || same_word(word, "-inf");
      values.push_back(endless ? (word[0] == '-' ? -1e9 : 1e9) : lines_.number(word));
      at = text.find_first_not_of(' ', end);
    }
    if (values.size() % 2) lines_.fail("a limit needs two numbers", "write (least most)");
    for (size_t i = 0; i < values.size(); i += 2) bone.limits.push_back({values[i], values[i + 1]});
    if (bone.limits.size() > bone.freedoms.size())
      lines_.fail("more limits than freedoms", "give one for each");
  }

  void end_bone() {
    AsfBone& bone = asf_.bones.back();
    in_bone_ = in_limits_ = false;
    if (bone.name.empty()) lines_.fail("a bone without a name", "give it one");
    const double norm = bone.direction.norm();
    if (!(norm > 1e-9) || !(bone.length >= 0))
      lines_.fail("bone " + WordLines::quoted(bone.name) + " has no direction or no length",
                  "give it both");
    // Written with six digits, a direction is never quite of unit length; others take it as it is.
    if (std::abs(norm - 1) > 1e-4) bone.direction /= norm;
    if (!index_.emplace(bone.name, static_cast<int>(asf_.bones.size()) - 1).second ||
        bone.name == "root")
      lines_.fail("two bones are called " + WordLines::quoted(bone.name), "give each its own name");
  }

  void hierarchy_line() {
    if (same_word(words()[0], "begin") || same_word(words()[0], "end")) return;
    const int parent = bone_index(words()[0]);
    for (size_t i = 1; i < words().size(); ++i) {
      const int child = bone_index(words()[i]);
      AsfBone& bone = asf_.bones[child];
      if (child == 0 || bone.parent >= 0)
        lines_.fail("bone " + WordLines::quoted(bone.name) + " has two parents", "keep one");
      bone.parent = parent;
    }
  }

  int bone_index(std::string_view word) const {
    if (word == "root") return 0;
    const auto at = index_.find(std::string(word));
    if (at == index_.end())
      lines_.fail("'" + WordLines::quoted(word) + "' is no bone of :bonedata", "correct the name");
    return at->second;
  }

  /// Parents before children, in the order of the file; loops and orphans are found out.
  AsfFile finish() {
    if (in_bone_) lines_.fail("ends within a bone", "give the whole file");
    if (asf_.bones.size() < 2) throw InputError(path_, "holds no bones", "give an ASF file");
    if (asf_.bones[0].freedoms.empty())
      throw InputError(path_, "its root has no 'order'", "give a whole ASF file");
    asf_.bones[0].axis =
        in_order(asf_.root_axes, asf_.radians ? Vec3(orientation_ * kDegrees) : orientation_);
    std::vector<std::vector<int>> children(asf_.bones.size());
    for (size_t b = 1; b < asf_.bones.size(); ++b) {
      if (asf_.bones[b].parent < 0)
        throw InputError(
            path_,
            "bone " + WordLines::quoted(asf_.bones[b].name) + " has no place in the hierarchy",
            "add it, or give the whole file");
      children[asf_.bones[b].parent].push_back(static_cast<int>(b));
    }
    std::vector<int> order = {0};
    for (size_t i = 0; i < order.size(); ++i)
      for (const int child : children[order[i]]) order.push_back(child);
    if (order.size() != asf_.bones.size())
      throw InputError(path_, "its hierarchy has a loop", "correct it");
    std::vector<int> place(order.size());
    for (size_t i = 0; i < order.size(); ++i) place[order[i]] = static_cast<int>(i);
    std::vector<AsfBone> sorted;
    for (const int b : order) {
      AsfBone& bone = sorted.emplace_back(std::move(asf_.bones[b]));
      if (bone.parent >= 0) bone.parent = place[bone.parent];
    }
    asf_.bones = std::move(sorted);
    return std::move(asf_);
  }

  WordLines lines_;
  const std::string& path_;
  AsfFile asf_;
  std::map<std::string, int> index_;
  Vec3 orientation_ = Vec3::Zero();
  bool any_section_ = false, in_bone_ = false, in_limits_ = false;
};

}  // namespace

AsfFile parse_asf(std::string_view text, const std::string& path) {
  return AsfParser(text, path).parse();
}

SourceSkeleton asf_skeleton(const AsfFile& asf) {
  SourceSkeleton out;
  for (const AsfBone& bone : asf.bones) {
    const bool root = bone.parent < 0;
    const AsfBone& parent = asf.bones[root ? 0 : bone.parent];
    out.add(bone.name, bone.parent,
            root ? asf.root_position : Vec3(parent.direction * parent.length));
    out.ends.back() = bone.direction * bone.length;
    out.has_end.back() = !root;
  }
  return out;
}

std::vector<Quat> asf_pose(const AsfFile& asf, const std::vector<double>& values, bool radians,
                           Vec3& position) {
  std::vector<Quat> out;
  out.reserve(asf.bones.size());
  position = asf.root_position;
  size_t next = 0;
  for (const AsfBone& bone : asf.bones) {
    Quat turn = Quat::Identity();
    Vec3 root_angles = Vec3::Zero();
    for (const AsfFreedom& freedom : bone.freedoms) {
      const double value = values[next++];
      if (!freedom || (!is_rotation(*freedom) && bone.parent >= 0)) continue;
      if (!is_rotation(*freedom)) {
        position[axis_of(*freedom)] += value;
        continue;
      }
      const double degrees = radians ? value * kDegrees : value;
      root_angles[axis_of(*freedom)] = degrees;
      turn = channel_rotation(*freedom, degrees) * turn;
    }
    if (bone.parent < 0) turn = in_order(asf.root_axes, root_angles);
    out.push_back(bone.axis * turn * bone.axis.conjugate());
  }
  return out;
}

}  // namespace restage
